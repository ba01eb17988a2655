"""Alternative paths reach the same goal, are clear, differ and come in their rank."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.planning.alternatives import alternative_paths, difference, travel
from lariat.planning.problem import Problem, WholePath
from lariat.rod import Rod, RodProperties
from lariat.scenario.sections import Goal, Limits

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
BOX = Obstacle("box", (0.0, 0.0, 0.2), size=(0.7, 0.06, 0.4), name="box")


@pytest.fixture(scope="module")
def across_a_box() -> Problem:
    """Problem of a goal behind a box, over which and beside which the rope can pass."""
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 16)
    start, goal = (
        tuple(Pose(np.array([x, y, 0.35]), LEVEL) for x in (-0.19, 0.19)) for y in (-0.2, 0.2)
    )
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    return Problem(
        rod=rod,
        state=rod.rest(*start).state,
        grips=(start[0], start[1]),
        goal=Goal(rod.rest(*goal).state.positions, goal[0], goal[1]),
        moves=moves,
        obstacles=(TABLE, BOX),
        supports=(),
        limits=Limits(),
        clearance=0.012,
        tolerance=0.003,
    )


@pytest.fixture(scope="module")
def paths(across_a_box: Problem) -> list[WholePath]:
    return alternative_paths(across_a_box, 3)


def test_alternatives_reach_the_goal_and_touch_nothing(
    across_a_box: Problem, paths: list[WholePath]
) -> None:
    assert 2 <= len(paths) <= 3
    for path in paths:
        assert path.reached
        swept = [chain_clearance(n, 0.004, across_a_box.obstacles) for n in path.nodes]
        assert min(swept) > 0.005
        np.testing.assert_allclose(path.nodes[-1], across_a_box.goal.nodes, atol=5e-3)


def test_alternatives_pass_elsewhere(paths: list[WholePath]) -> None:
    for first, second in combinations(paths, 2):
        assert difference(first, second) > 0.05
        assert difference(first, second) == pytest.approx(difference(second, first))
    assert difference(paths[0], paths[0]) == 0.0


def test_alternatives_are_ranked_by_clearance_then_time(paths: list[WholePath]) -> None:
    lacks = [round(1e3 * max(0.012 - path.clearance, 0.0)) for path in paths]
    assert lacks == sorted(lacks)
    for k in range(len(paths) - 1):
        if lacks[k] == lacks[k + 1]:
            assert paths[k].duration <= paths[k + 1].duration
    assert all(travel(path) > 0.4 for path in paths)


def test_without_a_path_the_nearest_shape_is_the_only_alternative(across_a_box: Problem) -> None:
    buried = Obstacle("sphere", (0.0, 0.2, 0.35), radius=0.3, name="ball")
    (path,) = alternative_paths(replace(across_a_box, obstacles=(TABLE, buried)), 3)
    assert not path.reached
    assert "'ball'" in path.reason
