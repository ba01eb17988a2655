from __future__ import annotations

import cv2
import numpy as np

from dashboard.panels.camera_image import decode, draw_rope
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.scenario import load
from shared.messages import NodeChain

SCENARIO = load("scenarios/three-cylinders.toml")


def test_rope_is_drawn_where_the_camera_sees_it() -> None:
    intrinsics = Intrinsics.symmetric(320, 240, np.deg2rad(SCENARIO.sensing.field_of_view))
    camera = Camera(intrinsics, SCENARIO.camera_setups[0].T_world_camera)
    nodes = np.linspace([-0.1, 0.0, 0.2], [0.1, 0.0, 0.2], 20)
    image = np.zeros((240, 320, 3), np.uint8)
    draw_rope(image, NodeChain(positions=nodes.ravel()), camera)
    lit = np.argwhere(image.any(axis=2))[:, ::-1]
    pixels, _ = camera.project(nodes)
    distance = np.linalg.norm(lit[:, None] - pixels[None], axis=2)
    assert np.max(np.min(distance, axis=0)) < 2.0
    assert np.max(np.min(distance, axis=1)) < 8.0


def test_image_is_decoded_to_red_green_blue() -> None:
    red = np.zeros((16, 16, 3), np.uint8)
    red[..., 2] = 250  # OpenCV encodes blue, green, red.
    image = decode(cv2.imencode(".jpg", red)[1].tobytes())
    assert image is not None
    assert np.all(image[..., 0] > 240)
    assert np.all(image[..., 1:] < 15)


def test_damaged_image_is_none() -> None:
    assert decode(b"") is None
    assert decode(b"no jpeg at all") is None
