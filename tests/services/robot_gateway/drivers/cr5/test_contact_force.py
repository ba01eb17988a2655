"""Contact force relative to the force at rest."""

from __future__ import annotations

import numpy as np
import pytest

from services.robot_gateway.drivers.cr5.contact_force import FILTER_TIME_CONSTANT, ContactForce

TICK = 8_000_000
OFFSET = np.array([1.0, -2.0, 5.0])


def calibrated() -> tuple[ContactForce, int]:
    force, now = ContactForce(), 0
    force.calibrate()
    while not force.calibrated:
        assert force.magnitude == 0.0
        force.update(OFFSET, now)
        now += TICK
    return force, now


def test_force_at_rest_is_the_zero() -> None:
    force, now = calibrated()
    force.update(OFFSET, now)
    assert force.magnitude == pytest.approx(0.0, abs=1e-12)


def test_step_is_followed_with_the_filters_time_constant() -> None:
    force, now = calibrated()
    for _ in range(round(FILTER_TIME_CONSTANT / 0.008)):
        force.update(OFFSET + np.array([3.0, 0.0, 4.0]), now)
        now += TICK
    assert force.magnitude == pytest.approx(5.0 * (1.0 - np.exp(-1.0)), rel=0.1)
    for _ in range(200):
        force.update(OFFSET + np.array([3.0, 0.0, 4.0]), now)
        now += TICK
    assert force.magnitude == pytest.approx(5.0, rel=1e-3)
