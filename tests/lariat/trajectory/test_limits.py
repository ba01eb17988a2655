from __future__ import annotations

import numpy as np
import pytest

from lariat.trajectory import MotionLimits, clipped

LIMITS = MotionLimits(0.5, 2.0, 40.0, 1.5, 6.0, 120.0)


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan])
def test_limit_that_is_not_positive_is_named(speed: float) -> None:
    with pytest.raises(ValueError, match=r"limits\.speed.*positive"):
        MotionLimits(speed, 2.0, 40.0, 1.5, 6.0, 120.0)


def test_scaled_limits_are_a_fraction_of_each() -> None:
    half = LIMITS.scaled(0.5)
    assert half == MotionLimits(0.25, 1.0, 20.0, 0.75, 3.0, 60.0)
    np.testing.assert_array_equal(half.jerk_bounds, [[20.0], [60.0]])


def test_clipped_vectors_keep_their_direction_and_their_own_bound() -> None:
    vectors = np.array([[[3.0, 4.0, 0.0], [0.3, 0.0, 0.4]]])
    short = clipped(vectors, LIMITS.speed_bounds)
    np.testing.assert_allclose(short[0, 0], [0.3, 0.4, 0.0])
    np.testing.assert_array_equal(short[0, 1], vectors[0, 1])
