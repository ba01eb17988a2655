from __future__ import annotations

import math

import numpy as np
import pytest

from services.perception.marked import MarkedObstacles
from shared.geometry import poses
from shared.geometry.obstacles import Obstacle
from tests.services.perception.test_markers import CAMERA, SIDE, picture

BOX = Obstacle("box", (0.0, 0.0, 0.04), size=(0.1, 0.1, 0.08), name="box")
NOWHERE = np.zeros((720, 1280), np.uint16)


def test_an_obstacle_follows_its_marker() -> None:
    watched = MarkedObstacles({4: BOX}, {4: SIDE})
    image = picture((0.12, -0.05, 0.08), 0.6, 4)
    # Every third frame is searched, and three sightings are believed.
    moves = [watched.look(image, NOWHERE, CAMERA, [BOX])[1] for _ in range(7)]
    assert moves[:6] == [[]] * 6
    (move,) = moves[6]
    assert move.name == "box"
    assert np.linalg.norm(np.subtract(move.position, (0.12, -0.05, 0.04))) < 1e-3
    yaw = poses.logarithm(np.array(move.orientation))[2]
    assert yaw == pytest.approx(0.6, abs=math.radians(0.5))
    moved = BOX.moved(move.position, move.orientation)
    assert [watched.look(image, NOWHERE, CAMERA, [moved])[1] for _ in range(3)] == [[]] * 3


def test_a_rope_across_a_marker_is_seen_and_the_marker_is_not() -> None:
    box = BOX.moved((0.12, -0.05, 0.04), tuple(poses.exponential(np.array([0.0, 0.0, 0.6]))))
    image = picture((0.12, -0.05, 0.08), 0.6, 4)
    (_, v), z = CAMERA.project(np.array([0.12, -0.05, 0.08]))
    depth = np.full((720, 1280), round(1e3 * float(z)), np.uint16)
    rows = slice(round(float(v)) - 4, round(float(v)) + 4)
    image[rows], depth[rows] = 255, depth[0, 0] - 30
    dark, _ = MarkedObstacles({4: BOX}, {4: SIDE}).look(image, depth, CAMERA, [box])
    assert np.all(dark[rows] == 255)
    dark[rows] = 0
    assert np.count_nonzero(dark[..., 0] > 200) == 0


def test_a_foreign_marker_moves_nothing_but_is_masked() -> None:
    watched = MarkedObstacles({4: BOX}, {4: SIDE})
    image = picture((0.12, -0.05, 0.08), 0.6, 9)
    looks = [watched.look(image, NOWHERE, CAMERA, [BOX]) for _ in range(4)]
    assert all(moves == [] for _, moves in looks)
    dark = looks[-1][0]
    assert np.count_nonzero(dark[..., 0] > 200) == 0
