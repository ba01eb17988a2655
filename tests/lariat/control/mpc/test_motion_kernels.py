"""Velocities within bounds, as compiled."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.mpc.motion_kernels import bounds_of, kernel, rows_of
from lariat.trajectory import MotionLimits, clipped

LIMITS = MotionLimits(0.3, 1.5, 20.0, 1.0, 5.0, 60.0)
STEP = 0.05


@pytest.mark.parametrize("scale", [0.0, 0.01, 1.0])
def test_velocities_are_bounded_one_step_after_the_other(scale: float) -> None:
    random = np.random.default_rng(0)
    initial, wanted = (
        scale * random.normal(size=(2, 2, 3)),
        scale * random.normal(size=(5, 2, 2, 3)),
    )
    bounded = np.empty_like(wanted)
    arrays = rows_of(initial), rows_of(wanted), bounds_of(LIMITS), bounded.reshape(-1, 3)
    kernel("bound_velocities")(*arrays, STEP)
    last = initial
    for velocities, found in zip(wanted, bounded, strict=True):
        change = clipped(velocities, LIMITS.speed_bounds) - last
        last = last + clipped(change, STEP * LIMITS.acceleration_bounds)
        np.testing.assert_allclose(found, last, atol=1e-14)
