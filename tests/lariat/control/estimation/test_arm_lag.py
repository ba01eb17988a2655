"""Lag of arms that follow a known motion late."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.estimation.arm_lag import ArmLag, ArmLagSettings
from lariat.trajectory import MotionState
from tests.services.controller.cell import grips

REST = MotionState.at_rest(*grips((-0.2, 0.0, 0.3), (0.2, 0.0, 0.3)))


def motion(seconds: float) -> MotionState:
    """Right grip on a smooth way of 0.2 m that takes 2 s; the left one rests."""
    s = min(max(seconds / 2.0, 0.0), 1.0)
    positions, twists = REST.positions.copy(), REST.twists.copy()
    positions[1, 1] += 0.2 * s * s * (3.0 - 2.0 * s)
    twists[1, 0, 1] = 0.2 * 6.0 * s * (1.0 - s) / 2.0
    return MotionState(positions, REST.orientations, twists, REST.accelerations)


def followed(lag: float, until: float) -> ArmLag:
    """Estimator that has observed arms with a lag."""
    found = ArmLag()
    for k in range(round(until / 0.02)):
        found.observe(k * 20_000_000, motion(0.02 * k), motion(0.02 * k - lag))
    return found


@pytest.mark.parametrize("lag", [0.0, 0.03, 0.1])
def test_lag_is_found_within_half_a_second_of_motion(lag: float) -> None:
    assert followed(lag, 0.6).lag == pytest.approx(lag, abs=0.006)
    assert followed(lag, 2.0).lag == pytest.approx(lag, abs=0.001)


def test_executed_motion_is_the_measured_one() -> None:
    found = followed(0.1, 1.0)
    executed = found.executed(980_000_000)
    np.testing.assert_allclose(executed.positions, motion(0.98 - 0.1).positions, atol=3e-4)


def test_lag_is_kept_while_the_arms_rest_and_begin_anew() -> None:
    found = followed(0.1, 2.0)
    found.restart()
    for k in range(200, 210):
        found.observe(k * 20_000_000, REST, REST)
    assert found.lag == pytest.approx(0.1, abs=0.005)


def test_expected_lag_holds_until_the_arms_have_moved() -> None:
    found = ArmLag(ArmLagSettings(expected_lag=0.1))
    for k in range(50):
        found.observe(k * 20_000_000, REST, REST)
    assert found.lag == 0.1
    for k in range(50, 100):
        moved = 0.02 * (k - 50)
        found.observe(k * 20_000_000, motion(moved), motion(moved - 0.03))
    assert found.lag == pytest.approx(0.03, abs=0.004)
