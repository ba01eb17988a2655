from __future__ import annotations

import math

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from services.perception.markers.marker_obstacles import MarkerObstacles
from tests.services.perception.markers.test_marker_detection import CAMERA, SIDE, picture

BOX = Obstacle("box", (0.0, 0.0, 0.04), size=(0.1, 0.1, 0.08), name="box")
NOWHERE = np.zeros((720, 1280), np.uint16)
FRAME = 33_333_333
"""Between two frames [ns]."""


def level(height: float) -> np.ndarray:
    """Depth of a horizontal plane [mm]."""
    rows, columns = np.mgrid[:720, :1280]
    rays = CAMERA.rays(np.stack([columns, rows], axis=-1).reshape(-1, 2).astype(float))
    eye = CAMERA.T_world_camera
    forward = rays @ poses.rotate(eye.orientation, np.array([0.0, 0.0, 1.0]))
    return (1e3 * (height - eye.position[2]) / rays[:, 2] * forward).reshape(720, 1280)


def test_an_obstacle_follows_its_marker() -> None:
    watched = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008)
    image = picture((0.12, -0.05, 0.08), 0.6, 4)
    # Every third frame is searched, and three sightings are believed.
    moves = [watched.update(image, NOWHERE, FRAME * k, CAMERA, [BOX])[1] for k in range(7)]
    assert moves[:6] == [[]] * 6
    (move,) = moves[6]
    assert move.name == "box"
    assert np.linalg.norm(np.subtract(move.position, (0.12, -0.05, 0.04))) < 1e-3
    yaw = poses.logarithm(np.array(move.orientation))[2]
    assert yaw == pytest.approx(0.6, abs=math.radians(0.5))
    moved = BOX.moved(move.position, move.orientation)
    later = [watched.update(image, NOWHERE, FRAME * k, CAMERA, [moved])[1] for k in range(7, 10)]
    assert later == [[]] * 3


def test_a_rope_across_a_marker_is_seen_and_the_marker_is_not() -> None:
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


def test_a_foreign_marker_moves_nothing_but_is_masked() -> None:
    watched = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008)
    image = picture((0.12, -0.05, 0.08), 0.6, 9)
    looks = [watched.update(image, NOWHERE, FRAME * k, CAMERA, [BOX]) for k in range(4)]
    assert all(moves == [] for _, moves in looks)
    dark = looks[-1][0]
    assert np.count_nonzero(dark[..., 0] > 200) == 0


def test_a_marker_moved_while_the_rope_hides_it_is_not_taken_for_rope() -> None:
    box = BOX.moved((0.12, -0.05, 0.04), tuple(poses.exponential(np.array([0.0, 0.0, 0.6]))))
    # It has gone 40 mm from where it was last seen.
    image = picture((0.12, -0.01, 0.08), 0.6, 4)
    (u, v), _ = CAMERA.project(np.array([0.12, -0.01, 0.08]))
    plate, depth = level(0.08), level(0.0).astype(np.uint16)
    face = (slice(round(float(v)) - 65, round(float(v)) + 65),)
    face += (slice(round(float(u)) - 65, round(float(u)) + 65),)
    depth[face] = plate[face]
    rope = slice(round(float(v)) - 4, round(float(v)) + 4)
    image[rope], depth[rope] = 255, plate[rope] - 25.0
    # Another strand lies beside it, as high as the plate.
    strand = slice(round(float(v)) - 80, round(float(v)) - 72)
    image[strand], depth[strand] = 255, plate[strand]
    dark, _ = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008).update(image, depth, 0, CAMERA, [box])
    assert np.all(dark[rope] == 255)
    assert np.all(dark[strand] == 255)
    dark[rope] = dark[strand] = 0
    assert np.count_nonzero(dark[..., 0] > 200) == 0


def test_two_sightings_elsewhere_are_enough_for_a_marker_that_is_known() -> None:
    watched = MarkerObstacles({4: BOX}, {4: SIDE}, 0.008)
    before, after = picture((0.0, 0.0, 0.08), 0.0, 4), picture((0.06, 0.0, 0.08), 0.0, 4)
    for k in range(5):
        assert watched.update(before, NOWHERE, 3 * FRAME * k, CAMERA, [BOX])[1] == []
    assert watched.update(after, NOWHERE, 15 * FRAME, CAMERA, [BOX])[1] == []
    (move,) = watched.update(after, NOWHERE, 18 * FRAME, CAMERA, [BOX])[1]
    assert np.linalg.norm(np.subtract(move.position, (0.06, 0.0, 0.04))) < 1e-3
