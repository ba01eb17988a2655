from __future__ import annotations

import numpy as np

from lariat.perception.tracking.paper_baseline import paper_nodes
from lariat.simulation.camera.sensor_noise import NOISELESS
from tests.services.perception.scenes import CAMERA, ROPE, curve, taken


def test_nodes_of_the_paper_lie_a_radius_above_the_axis() -> None:
    x = np.linspace(-0.2, 0.2, 30)
    nodes = np.stack([x, 0.0 * x, np.full(30, 0.2)], axis=1)
    frame = taken(nodes, noise=NOISELESS)
    found = paper_nodes(frame.color, frame.depth, CAMERA, nodes[0], 0.4, 30)
    middle = found[5:-5]
    # Nodes lie on the surface that faces the camera, not on the axis.
    gap = np.hypot(middle[:, 1], middle[:, 2] - 0.2)
    assert abs(np.median(gap) - ROPE.radius) < 1e-3


def test_nodes_of_the_paper_err_by_millimetres_to_centimetres_under_noise() -> None:
    errors = []
    for seed in range(3):
        nodes = curve(seed)
        frame = taken(nodes, frame=seed)
        found = paper_nodes(frame.color, frame.depth, CAMERA, nodes[0], ROPE.length, 30)
        count = min(len(found), 30)
        errors.append(np.mean(np.linalg.norm(found[:count] - nodes[:count], axis=1)))
    assert 0.002 < np.mean(errors) < 0.08


def test_a_dark_image_has_no_nodes() -> None:
    black = np.zeros((480, 640, 3), np.uint8)
    depth = np.full((480, 640), 900, np.uint16)
    assert len(paper_nodes(black, depth, CAMERA, np.zeros(3), 0.45, 30)) == 0
