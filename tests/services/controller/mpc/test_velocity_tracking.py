"""Limits and convergence of jerk-limited velocity tracking."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import MotionState, stopping_states
from services.controller.mpc.velocity_tracking import jerk_towards
from shared.scenario.sections import Limits

DT = 0.02
REST = MotionState.at_rest(
    Pose(np.array([-0.2, 0.0, 0.3]), poses.IDENTITY),
    Pose(np.array([0.2, 0.0, 0.3]), poses.IDENTITY),
)


def integrated(motion: MotionState, jerk: np.ndarray) -> MotionState:
    """Motion after one period with constant jerk."""
    v, a = motion.twists, motion.accelerations
    return motion.moved(
        DT * v + DT**2 / 2 * a + DT**3 / 6 * jerk, v + DT * a + DT**2 / 2 * jerk, a + DT * jerk
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
        jerk = jerk_towards(
            motion.twists, motion.accelerations, wanted, np.zeros_like(wanted), limits, DT
        )
        motion = integrated(motion, jerk)
        motions.append(motion)
    motions += stopping_states(motion, limits, DT)
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
        motion = integrated(
            motion,
            jerk_towards(motion.twists, motion.accelerations, wanted, 0.0 * wanted, limits, DT),
        )
        speeds.append(motion.twists[0, 0, 0])
    assert max(speeds) < 0.303
    assert abs(speeds[-1] - 0.3) < 1e-3
    assert speeds[12] > 0.28


def test_evenly_changing_velocity_is_followed_without_a_lag() -> None:
    limits, motion = Limits(), REST
    change = np.zeros((2, 2, 3))
    change[:, 0, 0] = 0.2
    for k in range(40):
        now = k * DT * change
        jerk = jerk_towards(motion.twists, motion.accelerations, now, change, limits, DT)
        motion = integrated(motion, jerk)
    np.testing.assert_allclose(motion.twists, 40 * DT * change, atol=1e-4)
