"""Faults of arms along a path and at the goal, with two CR5s."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.planning.arms.arm_check import arm_fault, goal_fault, start_fault
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.problem import Problem, WholePath
from lariat.planning.refinement import refined_path, seed_candidates
from lariat.planning.whole_path import plan
from tests.lariat.planning.arms.scenes import AT_THE_GOAL, IN_THE_WAY, two_arms


@pytest.fixture(scope="module")
def free() -> Problem:
    return two_arms()


@pytest.fixture(scope="module")
def usual(free: Problem) -> WholePath:
    """Path that looks at rope and grippers alone."""
    return plan(replace(free, arms=None))


def test_a_path_in_free_space_is_without_fault(free: Problem, usual: WholePath):
    assert arm_fault(free, usual) is None
    assert goal_fault(free) is None


def test_a_link_that_meets_a_post_is_a_fault_of_its_arm(usual: WholePath):
    fault = arm_fault(two_arms(IN_THE_WAY), usual)
    assert fault is not None
    assert (fault.rule, fault.side) == ("keep_out", "left")
    assert "link" in str(fault)
    assert "left arm" in str(fault)


def test_a_joint_that_turns_too_fast_is_a_fault(free: Problem, usual: WholePath):
    fault = arm_fault(free, replace(usual, dt=0.1 * usual.dt))
    assert fault is not None
    assert fault.rule == "joint_speed"


def test_a_plan_slows_down_until_the_joints_keep_their_acceleration(free: Problem):
    limited = replace(free, limits=replace(free.limits, joint_acceleration=0.5))
    fast, slow = plan(free), plan(limited)
    fault = arm_fault(limited, fast)
    assert fault is not None
    assert fault.rule == "joint_acceleration"
    assert slow.reached, slow.reason
    assert arm_fault(limited, slow) is None
    assert len(slow.positions) > len(fast.positions)


def test_a_way_beyond_the_reach_of_an_arm_is_a_fault(free: Problem, usual: WholePath):
    away = np.linspace(0.0, 1.0, len(usual.positions))[:, None, None] * [[0.0, 0.0, 0.9]]
    fault = arm_fault(free, replace(usual, positions=usual.positions + away))
    assert fault is not None
    assert fault.rule in ("singularity", "joint_limits")


def test_two_arms_that_meet_are_a_fault(free: Problem, usual: WholePath):
    share = np.linspace(0.0, 1.0, len(usual.positions))[:, None]
    crossed = usual.positions.copy()
    crossed[:, 0] += share * [0.25, 0.0, 0.0]
    crossed[:, 1] -= share * [0.25, 0.0, 0.0]
    fault = arm_fault(free, replace(usual, positions=crossed))
    assert fault is not None
    assert fault.rule == "spacing"
    assert "the two arms" in str(fault)


def test_a_goal_that_no_arm_can_hold_is_told_before_any_search():
    problem = two_arms(AT_THE_GOAL)
    fault = goal_fault(problem)
    assert fault is not None
    assert (fault.rule, fault.side) == ("keep_out", "left")
    path = plan(problem)
    assert not path.reached
    assert path.reason.startswith("unreachable: at the goal")
    assert "left arm" in path.reason


def test_a_start_in_an_obstacle_is_told():
    elbow = replace(AT_THE_GOAL, position=(-0.55, -0.1, 0.25), height=0.5)
    fault = start_fault(two_arms(elbow))
    assert fault is not None
    assert fault.side == "left"
    assert start_fault(two_arms()) is None


def test_a_goal_whose_grips_may_turn_is_not_judged():
    problem = two_arms(AT_THE_GOAL)
    assert goal_fault(replace(problem, moves=np.ones((2, 6), dtype=bool))) is None


def test_a_plan_leads_the_links_around_a_post():
    problem = two_arms(IN_THE_WAY)
    blind = plan(replace(problem, arms=None))
    assert blind.reached
    assert arm_fault(problem, blind) is not None
    path = plan(problem)
    assert path.reached
    assert arm_fault(problem, path) is None


def test_a_way_is_optimized_for_the_arms_once():
    optimizer = PathOptimizer(two_arms(IN_THE_WAY))
    (start,) = seed_candidates(optimizer, 1)
    first, again = (refined_path(optimizer, start) for _ in range(2))
    assert first.reached
    assert not again.reached
    assert again.arm_fault
    assert len(optimizer.led_arms) == 1
