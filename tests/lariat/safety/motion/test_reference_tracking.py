from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.safety.motion.reference_tracking import Braking, ReferenceTracker
from lariat.trajectory import MotionState, stopping_states
from tests.services.robot_gateway.cells import LIMITS

H = 0.008
TRACKER = ReferenceTracker(LIMITS)
REST = MotionState.at_rest(Pose(np.zeros(3), poses.IDENTITY))


def resting_at(x: float, angle: float = 0.0) -> MotionState:
    turned = poses.exponential(np.array([0.0, 0.0, angle]))
    return MotionState.at_rest(Pose(np.array([x, 0.0, 0.0]), turned))


def tracked(reference: MotionState, seconds: float) -> list[MotionState]:
    states = [REST]
    for _ in range(round(seconds / H)):
        states.append(TRACKER.step(states[-1], reference, reference, H))
    return states


def norms(values: list[np.ndarray]) -> np.ndarray:
    return np.linalg.norm(np.array(values), axis=-1)[:, 0]


@pytest.mark.parametrize(("x", "angle"), [(0.02, 0.0), (0.5, 0.0), (0.0, 1.5), (0.3, -2.0)])
def test_step_of_the_reference_is_reached_within_the_limits(x: float, angle: float) -> None:
    reference = resting_at(x, angle)
    states = tracked(reference, 6.0)
    np.testing.assert_allclose(states[-1].positions, reference.positions, atol=1e-4)
    np.testing.assert_allclose(
        np.abs(np.sum(states[-1].orientations * reference.orientations)), 1.0, atol=1e-7
    )
    speeds = norms([s.twists for s in states])
    accelerations = norms([s.accelerations for s in states])
    jerks = norms(list(np.diff([s.accelerations for s in states], axis=0) / H))
    assert np.all(speeds <= LIMITS.speed_bounds[:, 0] * (1.0 + 1e-9))
    assert np.all(accelerations <= LIMITS.acceleration_bounds[:, 0] * (1.0 + 1e-9))
    assert np.all(jerks <= LIMITS.jerk_bounds[:, 0] * (1.0 + 1e-9))


def test_position_does_not_overshoot_a_distant_reference() -> None:
    states = tracked(resting_at(0.5), 4.0)
    assert max(s.positions[0, 0] for s in states) <= 0.5 + 1e-3


@pytest.mark.parametrize(("share", "too_fast"), [(0.99, False), (1.0, False), (1.001, True)])
def test_speed_above_its_limit_is_too_fast(share: float, too_fast: bool) -> None:
    twists = np.zeros((1, 2, 3))
    twists[0, 0, 1] = share * LIMITS.speed
    moving = REST.moved(np.zeros((1, 2, 3)), twists, np.zeros((1, 2, 3)))
    assert TRACKER.too_fast(moving) is too_fast


def test_speed_that_will_exceed_its_limit_during_a_stop_is_too_fast() -> None:
    twists, accelerations = np.zeros((2, 1, 2, 3))
    twists[0, 0, 0], accelerations[0, 0, 0] = 0.48, 2.0
    assert TRACKER.too_fast(REST.moved(np.zeros((1, 2, 3)), twists, accelerations))


def test_braking_in_ticks_follows_the_planned_stop() -> None:
    twists = np.zeros((1, 2, 3))
    twists[0, 0, 0] = 0.4
    state = REST.moved(np.zeros((1, 2, 3)), twists, np.zeros((1, 2, 3)))
    planned = stopping_states(state, LIMITS, H)
    braking = Braking(TRACKER.stop(state))
    for expected in planned:
        state, braking = braking.step(state, H)
        np.testing.assert_allclose(state.positions, expected.positions, atol=1e-12)
        np.testing.assert_allclose(state.twists, expected.twists, atol=1e-12)
    assert state.resting


def test_command_at_rest_stays_at_rest() -> None:
    command = TRACKER.advance(REST, REST, REST, H)
    assert command.state.resting
    assert command.stop.duration == 0.0
