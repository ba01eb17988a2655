"""A motion is checked against the rules of its cell, with and without arms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.obstacles import Obstacle
from lariat.planning import plan, scenario_problem
from lariat.planning.problem import WholePath
from lariat.safety import ChunkRefused, check_motion
from lariat.scenario import Scenario, load


@pytest.fixture(scope="module", params=["three-cylinders", "fixed-end", "two-arms"])
def planned(request: pytest.FixtureRequest) -> tuple[Scenario, WholePath]:
    scenario = load(request.param)
    problem = scenario_problem(scenario)
    return scenario, plan(problem).of_grippers(problem)


def test_a_planned_path_keeps_every_rule(planned: tuple[Scenario, WholePath]) -> None:
    scenario, path = planned
    check_motion(scenario, path.positions, path.orientations, path.dt)


def test_the_broken_rule_is_named(planned: tuple[Scenario, WholePath]) -> None:
    scenario, path = planned
    ball = Obstacle("sphere", tuple(path.positions[len(path.positions) // 2, 1]), radius=0.03)
    for dt, obstacles, rule in (
        (path.dt / 4.0, None, "speed"),
        (path.dt, [*scenario.bodies, ball], "keep_out"),
    ):
        with pytest.raises(ChunkRefused) as refused:
            check_motion(scenario, path.positions, path.orientations, dt, obstacles)
        assert refused.value.rule == rule


def test_joints_of_arms_are_checked() -> None:
    scenario = load("two-arms")
    problem = scenario_problem(scenario)
    path = plan(problem).of_grippers(problem)
    for rule, limits in (
        ("joint_speed", replace(scenario.limits, joint_speed=0.1)),
        ("joint_acceleration", replace(scenario.limits, joint_acceleration=0.2)),
    ):
        with pytest.raises(ChunkRefused) as refused:
            check_motion(
                replace(scenario, limits=limits), path.positions, path.orientations, path.dt
            )
        assert refused.value.rule == rule


def test_an_arm_that_cannot_hold_the_start_is_refused() -> None:
    scenario = load("two-arms")
    far = np.tile(np.array([[-5.0, 0.0, 0.3], [5.0, 0.0, 0.3]]), (40, 1, 1))
    still = np.tile(np.array([1.0, 0.0, 0.0, 0.0]), (40, 2, 1))
    with pytest.raises(ChunkRefused):
        check_motion(scenario, far, still, 0.02)
