"""Convergence to the goal and limits of the grips in closed loop."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.rod import RolloutSpec
from lariat.scenario.sections import Limits
from tests.services.controller.cell import Cell, grips

BESIDE = grips((-0.16, 0.03, 0.28), (0.18, 0.02, 0.30))


@pytest.mark.parametrize("factor", [1.0, 6.0])
def test_rope_of_another_stiffness_reaches_its_own_rest_shape(factor: float) -> None:
    cell = Cell(stiffness_factor=factor)
    goal = cell.plant.rest(*BESIDE).state.positions
    cell.follow()
    cell.run(4.0, goal)
    assert cell.error(goal) < 3e-4


def test_grips_keep_their_limits_while_the_goal_jumps() -> None:
    cell = Cell()
    cell.follow()
    near, far = (
        cell.plant.rest(*g).state.positions
        for g in (BESIDE, grips((-0.2, -0.05, 0.33), (0.16, -0.04, 0.31)))
    )
    for goal in (near, far, near):
        cell.run(0.4, goal)
    limits = Limits()
    for order, bound in enumerate((limits.speed, limits.acceleration, limits.jerk), start=1):
        change = np.diff(cell.grip_positions, n=order, axis=0) / 0.02**order
        assert np.linalg.norm(change, axis=2).max() <= bound


@pytest.mark.parametrize("delay", [0.1])
def test_rope_settles_with_late_and_noisy_images(delay: float) -> None:
    cell = Cell(stiffness_factor=2.0, noise=2e-3, camera_delay=delay)
    goal = cell.plant.rest(*BESIDE).state.positions
    cell.follow()
    cell.run(4.0, goal)
    assert cell.error(goal) < 1.5e-3
    tail = np.array(cell.grip_positions[-50:])
    assert np.linalg.norm(tail - tail.mean(axis=0), axis=2).max() < 1.5e-3


def path(cell: Cell, shift: np.ndarray, seconds: float) -> ReferenceTrajectory:
    """Path of both grips by a displacement [m], smooth in time, with the rope along it."""
    s = np.linspace(0.0, 1.0, round(seconds / 0.02) + 1)
    travelled = (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))[:, None, None] * shift
    positions = np.array([g.position for g in cell.start]) + travelled
    orientations = np.repeat(np.array([g.orientation for g in cell.start])[None], len(s), axis=0)
    twists = np.zeros((len(s) - 1, 2, 6))
    twists[:, :, :3] = np.diff(positions, axis=0) / 0.02
    moved = cell.plant.rollout(RolloutSpec(cell.rope, twists, 0.02)).positions
    nodes = np.concatenate([cell.rope.positions[None], moved])
    return ReferenceTrajectory(positions, orientations, 0.02, nodes)


@pytest.mark.parametrize(("camera_delay", "arm_lag"), [(0.1, 0.0), (0.02, 0.1)])
def test_horizons_foresee_a_moving_rope_in_spite_of_late_images_and_arms(
    camera_delay: float, arm_lag: float
) -> None:
    cell = Cell(camera_delay=camera_delay, arm_lag=arm_lag)
    followed = path(cell, np.array([0.05, 0.15, 0.0]), 1.6)
    cell.follow(followed)
    cell.run(1.7, followed.nodes[-1])
    # The lag is learnt in the first moments.
    assert cell.horizon_errors()[30:].max() < 1e-3
