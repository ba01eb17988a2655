"""Limits and convergence of jerk-limited velocity tracking."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lariat.control.mpc.velocity_tracking import track
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.scenario.sections import Limits
from lariat.trajectory import MotionLimits, MotionState, stopping_states

DT = 0.02
REST = MotionState.at_rest(
    Pose(np.array([-0.2, 0.0, 0.3]), poses.IDENTITY),
    Pose(np.array([0.2, 0.0, 0.3]), poses.IDENTITY),
)


def tracked(
    motion: MotionState, wanted: np.ndarray, change: np.ndarray, limits: MotionLimits
) -> MotionState:
    """Motion after one period that follows a velocity and its rate of change."""
    aims = np.stack([wanted, wanted + DT * change])
    still = np.zeros((2, 2, 3))
    next_one = track(still, motion.twists, motion.accelerations, aims, limits, DT)
    return motion.moved(
        next_one.displacements[0], next_one.velocities[0], next_one.accelerations[0]
    )


def norms(vectors: np.ndarray) -> np.ndarray:
    return np.linalg.norm(vectors, axis=-1, keepdims=True)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 40))
def test_random_velocities_end_at_rest_within_limits(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    limits = Limits()
    motion = REST
    motions = [motion]
    wanted = np.zeros((2, 2, 3))
    for _ in range(count):
        if random.random() < 0.3:
            wanted = random.normal(size=(2, 2, 3)) * 0.5
        motion = tracked(motion, wanted, np.zeros_like(wanted), limits)
        motions.append(motion)
    stop = stopping_states(motion, limits, DT)
    motions += [stop[k] for k in range(len(stop))]
    assert motions[-1].resting
    speeds = np.array([norms(m.twists) for m in motions])
    accelerations = np.array([norms(m.accelerations) for m in motions])
    jerks = norms(np.diff([m.accelerations for m in motions], axis=0)) / DT
    assert (speeds <= 1.02 * limits.speed_bounds).all()
    assert (accelerations <= 1.001 * limits.acceleration_bounds).all()
    assert (jerks <= 1.001 * limits.jerk_bounds).all()
    # The gateway has the points alone.
    points = np.array([m.positions for m in motions])
    third = np.linalg.norm(np.diff(points, n=3, axis=0), axis=-1) / DT**3
    assert (third <= 1.001 * Limits().jerk).all()


def test_velocity_is_reached_without_overshoot() -> None:
    limits = Limits()
    wanted = np.zeros((2, 2, 3))
    wanted[:, 0, 0] = 0.3
    motion = REST
    speeds = []
    for _ in range(30):
        motion = tracked(motion, wanted, 0.0 * wanted, limits)
        speeds.append(motion.twists[0, 0, 0])
    assert max(speeds) < 0.303
    assert abs(speeds[-1] - 0.3) < 1e-3
    assert speeds[12] > 0.28


def test_evenly_changing_velocity_is_followed_without_a_lag() -> None:
    limits, motion = Limits(), REST
    change = np.zeros((2, 2, 3))
    change[:, 0, 0] = 0.2
    for k in range(40):
        motion = tracked(motion, k * DT * change, change, limits)
    np.testing.assert_allclose(motion.twists, 40 * DT * change, atol=1e-4)


def test_several_periods_are_those_one_after_the_other() -> None:
    limits, random = Limits(), np.random.default_rng(0)
    aims = random.normal(size=(6, 2, 2, 3)) * 0.3
    aims[:, 1, 1] = 0.0
    motion = REST
    whole = track(np.zeros((2, 2, 3)), motion.twists, motion.accelerations, aims, limits, DT)
    for k in range(5):
        motion = tracked(motion, aims[k], (aims[k + 1] - aims[k]) / DT, limits)
        np.testing.assert_allclose(whole.velocities[k], motion.twists, atol=1e-12)
        np.testing.assert_allclose(whole.accelerations[k], motion.accelerations, atol=1e-10)
    moved = motion.positions - REST.positions
    np.testing.assert_allclose(whole.displacements[-1, :, 0], moved, atol=1e-12)
    assert not whole.displacements[:, 1, 1].any()
