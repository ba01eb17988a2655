"""Marked obstacles at their true poses, which perception finds through the camera."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lariat.geometry import poses
from shared import topics
from shared.messages import Obstacle, Scene, SceneRequest, TaskState, chain
from tests.services.perception.cell import Cell, scenario

MARKED = """
[[obstacles]]
name = "block"
shape = "box"
position = [0.0, -0.15, 0.03]
size = [0.06, 0.06, 0.06]
marker = 7
stands_at = [0.05, -0.18, 0.03]
stands_turned = 25.0
[[events]]
time = 0.5
move_obstacle = "block"
position = [-0.1, -0.2, 0.03]
"""
PLACE, TURN = (0.05, -0.18, 0.03), math.radians(25.0)


def believed(cell: Cell, name: str = "block") -> Obstacle:
    scene: Scene = cell.has_subscribers[topics.SCENE_STATE.key][-1]
    return next(o for o in scene.obstacles if o.name == name)


def assert_at(obstacle: Obstacle, place: tuple[float, ...], turn: float) -> None:
    assert np.linalg.norm(np.subtract(obstacle.position, place)) < 1e-3
    yaw = poses.logarithm(np.array(obstacle.orientation))[2]
    assert yaw == pytest.approx(turn, abs=math.radians(0.5))


def test_a_marked_obstacle_is_found_where_it_stands_and_followed_when_it_is_moved() -> None:
    cell = Cell(scenario(MARKED))
    cell.run(0.2)
    assert believed(cell).position[0] == pytest.approx(0.0)
    cell.run(0.6)
    assert_at(believed(cell), PLACE, TURN)
    started = cell.stack.now
    cell.stack.send(topics.TASK_STATE, TaskState(stamp=started, run_started=started))
    cell.run(1.3)
    assert_at(believed(cell), (-0.1, -0.2, 0.03), TURN)
    # The rope is still seen, and no marker is taken for it.
    truth = cell.truth()
    for stamp, seen in cell.chains(topics.ROPE_NODES).items():
        assert not seen.lost
        gap = chain(seen.positions) - truth[stamp]
        assert np.max(np.linalg.norm(gap, axis=1)) < 3e-3


def test_a_requested_move_happens_only_if_perception_accepts_it() -> None:
    cell = Cell(scenario(MARKED))
    cell.run(0.8)
    for name, place in (("yes", [0.12, -0.2, 0.03]), ("no", [0.0, 0.0, 0.2])):
        request = SceneRequest(
            id=name, action=SceneRequest.MOVE, obstacle=Obstacle(name="block", position=place)
        )
        cell.stack.send(topics.SCENE_REQUEST, request)
        cell.run(0.8)
        assert_at(believed(cell), (0.12, -0.2, 0.03), TURN)
    assert "overlap" in cell.has_subscribers[topics.SCENE_STATE.key][-1].refusal
