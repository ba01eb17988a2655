from __future__ import annotations

import math

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.perception.markers.marker_obstacles import MarkerObstacles
from tests.lariat.perception.markers.test_marker_detection import CAMERA, SIDE, picture

BOX = Obstacle("box", (0.0, 0.0, 0.04), size=(0.1, 0.1, 0.08), name="box")
NO_DEPTH = np.zeros((720, 1280), np.uint16)
FRAME_PERIOD = 33_333_333
"""Time between two frames [ns]."""


def level(height: float) -> np.ndarray:
    """Depth of a horizontal plane [mm]."""
    rows, columns = np.mgrid[:720, :1280]
    rays = CAMERA.rays(np.stack([columns, rows], axis=-1).reshape(-1, 2).astype(float))
    eye = CAMERA.T_world_camera
    forward = rays @ poses.rotate(eye.orientation, np.array([0.0, 0.0, 1.0]))
    return (1e3 * (height - eye.position[2]) / rays[:, 2] * forward).reshape(720, 1280)


def test_an_obstacle_follows_its_marker() -> None:
    markers = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008)
    image = picture((0.12, -0.05, 0.08), 0.6, 4)
    # Every third frame is searched, and three detections move the obstacle.
    moves = [markers.update(image, NO_DEPTH, FRAME_PERIOD * k, CAMERA, [BOX])[1] for k in range(7)]
    assert moves[:6] == [[]] * 6
    (move,) = moves[6]
    assert move.name == "box"
    assert np.linalg.norm(np.subtract(move.position, (0.12, -0.05, 0.04))) < 1e-3
    yaw = poses.logarithm(np.array(move.orientation))[2]
    assert yaw == pytest.approx(0.6, abs=math.radians(0.5))
    moved = BOX.moved(move.position, move.orientation)
    later = [
        markers.update(image, NO_DEPTH, FRAME_PERIOD * k, CAMERA, [moved])[1] for k in range(7, 10)
    ]
    assert later == [[]] * 3


def test_a_marker_is_masked_and_the_rope_across_it_is_not() -> None:
    box = BOX.moved((0.12, -0.05, 0.04), tuple(poses.exponential(np.array([0.0, 0.0, 0.6]))))
    image = picture((0.12, -0.05, 0.08), 0.6, 4)
    (_, v), _ = CAMERA.project(np.array([0.12, -0.05, 0.08]))
    depth = level(0.08).astype(np.uint16)
    rows = slice(round(float(v)) - 4, round(float(v)) + 4)
    image[rows], depth[rows] = 255, depth[rows] - 20
    dark, _ = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008).update(image, depth, 0, CAMERA, [box])
    assert np.all(dark[rows] == 255)
    dark[rows] = 0
    assert np.count_nonzero(dark[..., 0] > 200) == 0


def test_an_unknown_marker_is_masked_and_moves_no_obstacle() -> None:
    markers = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008)
    image = picture((0.12, -0.05, 0.08), 0.6, 9)
    updates = [markers.update(image, NO_DEPTH, FRAME_PERIOD * k, CAMERA, [BOX]) for k in range(4)]
    assert all(moves == [] for _, moves in updates)
    dark = updates[-1][0]
    assert np.count_nonzero(dark[..., 0] > 200) == 0


def test_the_plate_of_a_hidden_marker_that_has_moved_is_masked() -> None:
    box = BOX.moved((0.12, -0.05, 0.04), tuple(poses.exponential(np.array([0.0, 0.0, 0.6]))))
    # The marker is 40 mm away from its last pose.
    image = picture((0.12, -0.01, 0.08), 0.6, 4)
    (u, v), _ = CAMERA.project(np.array([0.12, -0.01, 0.08]))
    plate, depth = level(0.08), level(0.0).astype(np.uint16)
    face = (slice(round(float(v)) - 65, round(float(v)) + 65),)
    face += (slice(round(float(u)) - 65, round(float(u)) + 65),)
    depth[face] = plate[face]
    rope = slice(round(float(v)) - 4, round(float(v)) + 4)
    image[rope], depth[rope] = 255, plate[rope] - 25.0
    # Another strand lies beside it, at the height of the plate.
    strand = slice(round(float(v)) - 80, round(float(v)) - 72)
    image[strand], depth[strand] = 255, plate[strand]
    dark, _ = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008).update(image, depth, 0, CAMERA, [box])
    assert np.all(dark[rope] == 255)
    assert np.all(dark[strand] == 255)
    dark[rope] = dark[strand] = 0
    assert np.count_nonzero(dark[..., 0] > 200) == 0


def test_a_known_marker_moves_its_obstacle_after_two_detections_elsewhere() -> None:
    markers = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008)
    before, after = picture((0.0, 0.0, 0.08), 0.0, 4), picture((0.06, 0.0, 0.08), 0.0, 4)
    for k in range(5):
        assert markers.update(before, NO_DEPTH, 3 * FRAME_PERIOD * k, CAMERA, [BOX])[1] == []
    assert markers.update(after, NO_DEPTH, 15 * FRAME_PERIOD, CAMERA, [BOX])[1] == []
    (move,) = markers.update(after, NO_DEPTH, 18 * FRAME_PERIOD, CAMERA, [BOX])[1]
    assert np.linalg.norm(np.subtract(move.position, (0.06, 0.0, 0.04))) < 1e-3
