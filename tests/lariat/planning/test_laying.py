from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.cable_routes import held_clips
from lariat.geometry.grips import Grips
from lariat.geometry.poses import Pose
from lariat.planning import Problem, WholePath, plan, scenario_problem
from lariat.planning.laying import plan_laying
from lariat.rod.strains import tensions
from lariat.scenario import load
from tests.robots import board_with_arms


@pytest.fixture(scope="module")
def board() -> Problem:
    return scenario_problem(load("harness-board"))


def jump(problem: Problem) -> WholePath:
    """Path of one step to the goal, in place of a search."""
    there = Grips.of(problem.goal.grips, problem.goal.grips)
    nodes = np.stack([problem.goal.nodes] * 2)
    return WholePath(there.positions, there.orientations, nodes, True, "", 0.0, np.inf)


@pytest.fixture(scope="module")
def path(board: Problem) -> WholePath:
    return plan_laying(board, jump)


def test_the_path_lays_the_rope_into_all_clips(board: Problem, path: WholePath):
    assert path.reached, path.reason
    assert held_clips(board.goal.route, board.supports, path.nodes[-1]) == ["low", "middle", "high"]
    assert path.final_error < board.tolerance
    np.testing.assert_allclose(
        path.positions[-1], [grip.position for grip in board.goal.grips], atol=1e-9
    )


def test_what_is_laid_stays_laid(board: Problem, path: WholePath):
    held = [held_clips(board.goal.route, board.supports, nodes) for nodes in path.nodes]
    counts = [len(names) for names in held]
    assert counts[0] == 0
    assert np.all(np.diff(counts) >= 0)
    assert next(names for names in held if names) == ["middle"]


def test_a_path_that_pulls_more_than_the_limit_is_refused(board: Problem, path: WholePath):
    most = float(np.max(tensions(path.nodes, board.rod.properties)))
    assert most < 0.5
    refused = plan_laying(replace(board, limits=replace(board.limits, tension=0.5 * most)), jump)
    assert not refused.reached
    assert f"{most:.2f} N" in refused.reason


def test_a_route_that_is_longer_than_the_rope_is_unreachable(board: Problem):
    left, right = board.goal.grips
    away = Pose(left.position - np.array([0.05, 0.0, 0.0]), left.orientation)
    path = plan_laying(board.with_goal(left=away, right=right), jump)
    assert path.reason.startswith("unreachable")


def test_arms_lay_the_rope_from_above_unless_a_joint_is_too_slow():
    problem = scenario_problem(board_with_arms())
    path = plan(problem)
    assert path.reached, path.reason
    assert held_clips(problem.goal.route, problem.supports, path.nodes[-1]) == [
        "low",
        "middle",
        "high",
    ]
    slow = replace(problem, limits=replace(problem.limits, joint_speed=0.1))
    refused = plan_laying(slow, lambda hanging: plan(replace(hanging, limits=problem.limits)))
    assert not refused.reached
    assert re.match(r"blocked: while it is laid, a joint of the \w+ arm turns", refused.reason)
