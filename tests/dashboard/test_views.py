from __future__ import annotations

import numpy as np

from dashboard import palette
from dashboard.panels.camera_image import decoded, draw_rope
from dashboard.scene.scene_view import VAGUE_SIGMA, camera_pose, certainty_colors
from lariat.geometry.cameras import Camera, Intrinsics
from shared.messages import NodeChain
from shared.scenario import load

SCENARIO = load("scenarios/three-cylinders.toml")


def test_colours_tell_precise_vague_and_bridged_nodes_apart() -> None:
    message = NodeChain(
        positions=np.zeros(9), sigma=[0.0, VAGUE_SIGMA, 0.0], observed=[True, True, False]
    )
    np.testing.assert_array_equal(
        certainty_colors(message), [palette.ROPE, palette.VAGUE, palette.BRIDGED]
    )


def test_rope_is_drawn_where_the_camera_sees_it() -> None:
    intrinsics = Intrinsics.symmetric(320, 240, np.deg2rad(SCENARIO.sensing.field_of_view))
    camera = Camera(intrinsics, camera_pose(SCENARIO))
    nodes = np.linspace([-0.1, 0.0, 0.2], [0.1, 0.0, 0.2], 20)
    picture = np.zeros((240, 320, 3), np.uint8)
    draw_rope(picture, NodeChain(positions=nodes.ravel()), camera)
    lit = np.argwhere(picture.any(axis=2))[:, ::-1]
    pixels, _ = camera.project(nodes)
    distance = np.linalg.norm(lit[:, None] - pixels[None], axis=2)
    assert np.max(np.min(distance, axis=0)) < 2.0
    assert np.max(np.min(distance, axis=1)) < 8.0


def test_damaged_picture_is_none() -> None:
    assert decoded(b"") is None
    assert decoded(b"no jpeg at all") is None
