"""Derivative of a swinging rope with respect to the logarithms of damping and drag."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from lariat.control.estimation.history_sensitivity import HistorySensitivity
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.rod import Rod, RolloutSpec
from lariat.trajectory import MotionState
from tests.services.controller.cell import COUNT, PROPERTIES, grips

STEP = 10_000_000
START = grips((-0.16, 0.0, 0.3), (0.16, 0.0, 0.3))
MOTION = MotionState.at_rest(*START)
IN_AIR = replace(PROPERTIES, drag_coefficient=20.0)
NAMES = ("damping", "drag_coefficient")


def swinging(rod: Rod) -> StateEstimator:
    """Estimator of a rope between fixed grips that has just been pushed."""
    estimator = StateEstimator(rod, MOTION, STEP)
    velocities = np.zeros((COUNT, 3))
    velocities[2:-2, 1] = 0.5
    estimator.state = replace(estimator.state, velocities=velocities)
    return estimator


def followed(
    estimator: StateEstimator, steps: int, names: Sequence[str] = ("damping",)
) -> HistorySensitivity:
    """Sensitivity after some steps of the estimator."""
    sensitivity = HistorySensitivity(names)
    sensitivity.follow(estimator)
    for k in range(1, steps + 1):
        estimator.advance(MOTION, (k + 1) * STEP)
        sensitivity.follow(estimator)
    return sensitivity


@pytest.mark.parametrize(("k", "name"), list(enumerate(NAMES)))
def test_derivative_agrees_with_central_differences(k: int, name: str) -> None:
    rod, steps = Rod(IN_AIR, COUNT), 20
    jacobian = followed(swinging(rod), steps, NAMES).jacobian_at((steps + 1) * STEP)
    assert jacobian is not None
    ends = []
    for sign in (1.0, -1.0):
        value = getattr(IN_AIR, name) * math.exp(sign * 0.05)
        varied = rod.with_properties(replace(IN_AIR, **{name: value}))
        blocks = np.zeros(steps, dtype=np.int64)
        spec = RolloutSpec(
            swinging(rod).state, np.zeros((1, 2, 6)), STEP * 1e-9, block_of_step=blocks
        )
        ends.append(varied.rollout(spec).final.positions)
    expected = (ends[0] - ends[1]) / 0.1
    assert np.abs(expected).max() > 1e-3
    # The sensitivity is a one-sided difference over a factor of exp(0.3).
    assert np.linalg.norm(jacobian[..., k] - expected) < 0.25 * np.linalg.norm(expected)


def test_rope_at_rest_shows_no_damping() -> None:
    sensitivity = followed(StateEstimator(Rod(PROPERTIES, COUNT), MOTION, STEP), 5)
    jacobian = sensitivity.jacobian_at(6 * STEP)
    assert jacobian is not None
    assert np.abs(jacobian).max() < 1e-4


def test_derivative_is_that_of_the_nearest_time() -> None:
    estimator = swinging(Rod(PROPERTIES, COUNT))
    early = followed(estimator, 3).jacobian_at(4 * STEP)
    later = followed(swinging(Rod(PROPERTIES, COUNT)), 8).jacobian_at(4 * STEP + STEP // 3)
    assert early is not None
    assert np.array_equal(early, later)  # pyright: ignore


@pytest.mark.parametrize("gap", [0.6])
def test_models_restart_after_a_gap_and_after_a_reset(gap: float) -> None:
    estimator = swinging(Rod(PROPERTIES, COUNT))
    sensitivity = followed(estimator, 3)
    estimator.advance(MOTION, estimator.time + round(gap * 1e9))
    sensitivity.follow(estimator)
    assert sensitivity.jacobian_at(estimator.time) is None
    sensitivity = followed(estimator, 0)
    assert sensitivity.jacobian_at(estimator.time) is None
