"""Paths of grippers, which hold the rope's ends off their place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.planning.path_check import gripper_overlap, path_clearance
from lariat.planning.problem import Problem, WholePath
from lariat.rod import Rod, RodProperties
from lariat.scenario.sections import Goal, Limits

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
GRIPS = tuple(Pose(np.array([x, 0.0, 0.3]), LEVEL) for x in (-0.2, 0.2))
BESIDE = Pose(np.array([0.004, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
"""Pose of an end that is held 4 mm beside its gripper: along the gripper's x, the world's y."""


def problem_with(*obstacles: Obstacle, held: tuple[Pose, Pose]) -> Problem:
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 12)
    state = rod.rest(*GRIPS).state
    return Problem(
        rod=rod,
        state=state,
        grips=(GRIPS[0], GRIPS[1]),
        goal=Goal(state.positions, GRIPS[0], GRIPS[1]),
        moves=np.ones((2, 6), dtype=bool),
        obstacles=obstacles,
        supports=(),
        limits=Limits(),
        clearance=0.01,
        tolerance=0.003,
        held=held,
    )


def standing(problem: Problem) -> WholePath:
    here = Grips.of(problem.grips, problem.grips)
    nodes = np.array([problem.state.positions] * 2)
    return WholePath(here.positions, here.orientations, nodes, True, "", 0.0, 0.1)


def test_grippers_lead_the_ends_along_their_path() -> None:
    random = np.random.default_rng(0)
    ends = (
        Pose(np.array([0.003, -0.001, 0.002]), poses.exponential(np.array([0.03, 0.01, 0.0]))),
        Pose(np.array([0.0, 0.002, -0.004]), poses.exponential(np.array([0.0, -0.04, 0.02]))),
    )
    orientations = poses.normalized(random.normal(size=(5, 2, 4)))
    path = WholePath(
        random.normal(size=(5, 2, 3)), orientations, np.zeros((5, 8, 3)), True, "", 0.0, 0.1
    )
    led = path.of_grippers(problem_with(held=ends))
    for k in range(5):
        for side, end in enumerate(ends):
            found = Pose(led.positions[k, side], led.orientations[k, side]) @ end
            assert found.position == pytest.approx(path.positions[k, side])
            assert abs(found.orientation @ path.orientations[k, side]) == pytest.approx(1.0)


def test_clearance_of_a_path_is_that_of_grippers_beside_the_ends() -> None:
    """Gripper and post stand apart along the line on which the rope's end is off by 4 mm."""
    post = Obstacle("sphere", (-0.2, -0.1, 0.3), radius=0.05, name="post")
    exact = problem_with(post, held=(BESIDE.inverse() @ BESIDE, BESIDE.inverse() @ BESIDE))
    path = standing(exact)
    apart = path_clearance(exact, path, path.nodes)
    assert apart == pytest.approx(0.05 - Limits().gripper_radius)
    beside = replace(exact, held=(BESIDE, BESIDE))
    nearer = path_clearance(beside, path, path.nodes)
    assert nearer == pytest.approx(apart - 0.004)


def test_overlap_of_grippers_is_that_of_their_bodies_beside_the_ends() -> None:
    """Both grippers stand 4 mm nearer to each other than the ends that they hold, on a level."""
    towards = Pose(np.array([0.0, 0.0, -0.004]), BESIDE.orientation)
    away = Pose(np.array([0.0, 0.0, 0.004]), BESIDE.orientation)
    problem = problem_with(held=(towards, away))
    path = standing(problem)
    bodies, _ = problem.gripper_distances(path)
    assert bodies == pytest.approx(0.4 - 2 * 0.004)
    assert gripper_overlap(problem, path) <= 0.0
