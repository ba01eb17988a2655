from __future__ import annotations

import math

import numpy as np
import pytest

from services.perception.marked import MarkedObstacles
from shared.geometry import poses
from shared.geometry.obstacles import Obstacle
from tests.services.perception.test_markers import CAMERA, picture

BOX = Obstacle("box", (0.0, 0.0, 0.04), size=(0.1, 0.1, 0.08), name="box")


def test_an_obstacle_follows_its_marker() -> None:
    watched = MarkedObstacles({4: BOX})
    image = picture((0.12, -0.05, 0.08), 0.6, 4)
    moves = [watched.look(image, CAMERA, [BOX])[1] for _ in range(3)]
    assert moves[:2] == [[], []]
    (move,) = moves[2]
    assert move.name == "box"
    assert np.linalg.norm(np.subtract(move.position, (0.12, -0.05, 0.04))) < 1e-3
    yaw = poses.logarithm(np.array(move.orientation))[2]
    assert yaw == pytest.approx(0.6, abs=math.radians(0.5))
    moved = BOX.moved(move.position, move.orientation)
    assert watched.look(image, CAMERA, [moved])[1] == []


def test_a_foreign_marker_moves_nothing_but_is_masked() -> None:
    watched = MarkedObstacles({4: BOX})
    image = picture((0.12, -0.05, 0.08), 0.6, 9)
    looks = [watched.look(image, CAMERA, [BOX]) for _ in range(4)]
    assert all(moves == [] for _, moves in looks)
    dark = looks[-1][0]
    assert np.count_nonzero(dark[..., 0] > 200) == 0
