"""Compiled motion of the command against that of NumPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.safety.motion.motion_kernels import (
    CompiledBlend,
    CompiledSpline,
    CompiledTracker,
    ReferenceKernel,
)
from lariat.safety.motion.reference_tracking import ReferenceTracker
from lariat.trajectory import Blend, MotionLimits, MotionState, SetpointChunk, Spline

LIMITS = MotionLimits(0.5, 2.0, 20.0, 2.0, 8.0, 80.0)
TICK = 8_000_000


def state(rng: np.random.Generator, count: int, scale: float) -> MotionState:
    turns = np.array([1.0, 0.0, 0.0, 0.0]) + 0.3 * rng.normal(size=(count, 4))
    return MotionState(
        0.1 * rng.normal(size=(count, 3)),
        poses.normalized(turns),
        scale * rng.normal(size=(count, 2, 3)),
        scale * rng.normal(size=(count, 2, 3)),
    )


def assert_same(found: MotionState, expected: MotionState) -> None:
    for name in ("positions", "orientations", "twists", "accelerations"):
        a, b = getattr(found, name), getattr(expected, name)
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("count", [1, 2])
def test_reference_is_that_of_numpy(count: int) -> None:
    rng = np.random.default_rng(0)
    turns = np.array([1.0, 0.0, 0.0, 0.0]) + 0.05 * np.cumsum(
        rng.normal(size=(12, count, 4)), axis=0
    )
    positions = 0.01 * np.cumsum(rng.normal(size=(12, count, 3)), axis=0)
    chunk = SetpointChunk(0, 0.02, positions, poses.normalized(turns))
    origin, kernel = state(rng, count, 0.3), ReferenceKernel(count)
    longer = replace(
        chunk,
        positions=np.tile(chunk.positions + 1.0, (9, 1, 1)),
        orientations=np.tile(chunk.orientations, (9, 1, 1)),
    )
    other, plain_other = CompiledSpline(kernel, longer, 0), Spline(longer, 0)
    spline, curve = Spline(chunk, 40_000_000), CompiledSpline(kernel, chunk, 40_000_000)
    # The curve begins after the transition: before its first pose it goes on straight.
    plain = Blend(spline, origin, TICK, 0.1)
    compiled = CompiledBlend(curve, origin, TICK, 0.1)
    for now in range(TICK, 400_000_000, 7_000_000):
        assert_same(other(now), plain_other(now))
        assert_same(curve(now), spline(now))
        assert_same(compiled(now), plain(now))


@pytest.mark.parametrize("scale", [0.0, 0.1, 1.0, 30.0])
@pytest.mark.parametrize("count", [1, 2])
def test_command_and_its_stop_are_those_of_numpy(count: int, scale: float) -> None:
    plain = ReferenceTracker(LIMITS)
    compiled = CompiledTracker(plain, count)
    rng = np.random.default_rng(1)
    for _ in range(50):
        states = [state(rng, count, scale) for _ in range(3)]
        expected, found = (t.advance(*states, 0.008) for t in (plain, compiled))
        assert_same(found.state, expected.state)
        assert found.too_fast == expected.too_fast
        np.testing.assert_allclose(found.stop.jerks, expected.stop.jerks, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(found.stop.durations, expected.stop.durations, atol=1e-12)
        np.testing.assert_allclose(found.path, expected.path, rtol=1e-12, atol=1e-12)


def test_command_at_rest_stays_at_rest() -> None:
    still = MotionState(np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), *(np.zeros((1, 2, 3)),) * 2)
    found = CompiledTracker(ReferenceTracker(LIMITS), 1).advance(*3 * (still,), 0.008)
    assert found.state.resting
    assert found.stop.duration == 0.0
