from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.trajectory import Blend, MotionState, Spline
from tests.lariat.trajectory.test_spline import SECOND, chunk_of


@pytest.mark.parametrize("duration", [0.06, 0.2])
def test_blend_begins_with_the_motion_before_it_and_ends_on_the_curve(duration: float) -> None:
    spline = Spline(chunk_of(0.1 * 0.02 * np.arange(40)), SECOND)
    origin = MotionState(
        np.array([[0.004, -0.003, 0.002]]),
        poses.exponential(np.array([[0.0, 0.02, 0.01]])),
        np.array([[[0.2, 0.05, 0.0], [0.1, 0.0, 0.0]]]),
        np.array([[[1.0, 0.0, -0.5], [0.0, 0.3, 0.0]]]),
    )
    now = SECOND + 30_000_000
    blend = Blend(spline, origin, now, duration)
    begun = blend(now)
    np.testing.assert_allclose(begun.positions, origin.positions, atol=1e-12)
    np.testing.assert_allclose(begun.twists, origin.twists, atol=1e-12)
    np.testing.assert_allclose(begun.accelerations, origin.accelerations, atol=1e-9)
    e = 0.001
    ahead = blend(now + round(e * 1e9))
    np.testing.assert_allclose(
        (ahead.positions - begun.positions) / e, origin.twists[:, 0], atol=3e-3
    )
    over = now + round(duration * 1e9)
    np.testing.assert_allclose(blend(over).positions, spline(over).positions, atol=1e-12)
