"""The constrained step satisfies its bounds, and equals the free one where no bound is near."""

from __future__ import annotations

import numpy as np
import pytest

from services.controller.mpc.constraints import constrained_step
from tests.services.controller.cell import PROPERTIES, Cell


@pytest.mark.parametrize("seed", range(8))
def test_solution_satisfies_the_optimality_conditions(seed: int) -> None:
    random = np.random.default_rng(seed)
    root = random.normal(size=(12, 6))
    hessian, slope = root.T @ root, random.normal(size=6)
    rows, values = random.normal(size=(4, 6)), random.normal(size=4) * 0.3
    step = constrained_step(hessian, slope, values, rows)
    slack = values + rows @ step
    assert slack.max() < 1e-5
    # What is left of the slope is a sum of active rows with multipliers that push inwards.
    active = rows[slack > -1e-5]
    multipliers, *_ = np.linalg.lstsq(active.T, -(hessian @ step + slope), rcond=None)
    assert np.allclose(active.T @ multipliers, -(hessian @ step + slope), atol=1e-4)
    assert np.all(multipliers > -1e-4)


def test_bounds_that_are_not_near_change_nothing() -> None:
    hessian, slope = 2.0 * np.eye(3), np.array([1.0, -2.0, 0.5])
    step = constrained_step(hessian, slope, np.full(2, -10.0), np.ones((2, 3)))
    assert np.allclose(step, -slope / 2.0)


def test_goal_longer_than_the_rope_does_not_pull_the_grips_too_far_apart() -> None:
    cell = Cell()
    stretched = cell.plant.rest(*cell.start).state.positions * np.array([2.5, 1.0, 1.0])
    cell.follow()
    cell.run(2.0, stretched)
    apart = [np.linalg.norm(p[1] - p[0]) for p in cell.points]
    # What is asked is kept exactly; the jerk that the arms are allowed lets them run over a little.
    assert max(apart) < 0.98 * PROPERTIES.length
    assert apart[-1] == pytest.approx(0.97 * PROPERTIES.length, abs=1e-4)
