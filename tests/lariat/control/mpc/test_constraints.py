"""Steps within linear bounds, and their effect on the grips."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.control.mpc.constraints import constrained_step
from tests.services.controller.cell import PROPERTIES, Cell


@pytest.mark.parametrize("seed", range(8))
def test_solution_satisfies_the_optimality_conditions(seed: int) -> None:
    random = np.random.default_rng(seed)
    root = random.normal(size=(12, 6))
    hessian, gradient = root.T @ root, random.normal(size=6)
    rows, values = random.normal(size=(4, 6)), random.normal(size=4) * 0.3
    step = constrained_step(hessian, gradient, values, rows)
    slack = values + rows @ step
    assert slack.max() < 1e-5
    # The remaining gradient is a sum of active rows with positive multipliers.
    active = rows[slack > -1e-5]
    multipliers, *_ = np.linalg.lstsq(active.T, -(hessian @ step + gradient), rcond=None)
    assert np.allclose(active.T @ multipliers, -(hessian @ step + gradient), atol=1e-4)
    assert np.all(multipliers > -1e-4)


def test_inactive_bounds_leave_the_unconstrained_step() -> None:
    hessian, gradient = 2.0 * np.eye(3), np.array([1.0, -2.0, 0.5])
    step = constrained_step(hessian, gradient, np.full(2, -10.0), np.ones((2, 3)))
    assert np.allclose(step, -gradient / 2.0)


def test_grip_distance_stays_within_its_bound_for_a_goal_longer_than_the_rope() -> None:
    cell = Cell()
    stretched = cell.plant.rest(*cell.start).state.positions * np.array([2.5, 1.0, 1.0])
    cell.follow()
    cell.run(2.0, stretched)
    apart = [np.linalg.norm(p[1] - p[0]) for p in cell.grip_positions]
    # The horizon keeps the bound exactly; the limit on jerk lets the grips exceed it a little.
    assert max(apart) < 0.98 * PROPERTIES.length
    assert apart[-1] == pytest.approx(0.97 * PROPERTIES.length, abs=1e-4)


def test_rope_that_is_learnt_to_be_longer_than_given_is_not_stretched() -> None:
    cell = Cell()
    longer = replace(PROPERTIES, length=1.01 * PROPERTIES.length)
    cell.estimator.rest_with_material(cell.model.with_properties(longer))
    cell.plant = cell.plant.with_properties(longer)
    cell.rope = cell.plant.rest(*cell.start).state
    cell.max_stretch = 0.002
    cell.follow()
    cell.run(0.6, cell.rope.positions)
    moved = np.linalg.norm(np.array(cell.grip_positions) - cell.grip_positions[0], axis=2)
    assert moved.max() < 1e-3
