"""Timed paths keep the limits and rest at both ends."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from services.planner.timing import SHARE, Pace, timed
from shared.geometry import poses
from shared.scenario.sections import Limits

DT = 0.02


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 12), st.floats(0.001, 0.5))
def test_timed_path_keeps_limits_and_rests_at_both_ends(seed: int, count: int, size: float) -> None:
    random = np.random.default_rng(seed)
    limits = Limits()
    ways = size * random.normal(size=(count, 2, 3))
    turns = np.cumsum(0.5 * random.normal(size=(count, 2, 3)), axis=0)
    orientations = poses.exponential(turns)
    positions, turned = timed(ways, orientations, limits, DT, Pace())
    assert np.allclose(positions[[0, -1]], ways[[0, -1]], atol=1e-12)
    last = poses.multiply(turned[-1], poses.conjugate(orientations[-1]))
    assert np.linalg.norm(poses.logarithm(last), axis=1).max() < 1e-9
    still = np.concatenate([positions[:1]] * 3 + [positions] + [positions[-1:]] * 3)
    for order, bound in enumerate((limits.speed, limits.acceleration, limits.jerk), start=1):
        change = np.linalg.norm(np.diff(still, n=order, axis=0), axis=2) / DT**order
        assert change.max() <= SHARE * bound * 1.01


def test_slower_path_takes_longer() -> None:
    ways = np.array([[[0.0, 0, 0], [0.4, 0, 0]], [[0.0, 0.3, 0], [0.4, 0.3, 0]]])
    level = np.tile(poses.IDENTITY, (2, 2, 1))
    quick, _ = timed(ways, level, Limits(), DT, Pace())
    slow, _ = timed(ways, level, Limits(), DT, Pace(2.0))
    assert len(quick) < 100
    assert 1.6 * len(quick) < len(slow) < 2.2 * len(quick)
