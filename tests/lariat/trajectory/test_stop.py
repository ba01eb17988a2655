from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import MotionLimits, MotionState, Stop, peak_twists, stopping_states

LIMITS = MotionLimits(0.5, 2.0, 40.0, 1.5, 6.0, 120.0)
A, J = 2.0, 40.0


def motion(vector: tuple[float, float, float]) -> np.ndarray:
    return np.array([[vector, (0.0, 0.0, 0.0)]])


unit = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@settings(max_examples=80, deadline=None)
@given(unit, unit)
def test_stop_ends_at_rest_within_the_limits(v: tuple, a: tuple) -> None:
    velocity, acceleration = 0.28 * motion(v), 1.15 * motion(a)
    stop = Stop.plan(velocity, acceleration, LIMITS)
    t = np.linspace(0.0, stop.duration, 400)[:, None, None, None]
    x, speed, acc = stop.at(t)
    dt = stop.duration / 399
    assert np.all(np.linalg.norm(acc, axis=-1)[:, 0, 0] <= A + 1e-9)
    peak = np.linalg.norm(peak_twists(velocity, acceleration, LIMITS)[0, 0])
    allowed = max(peak, np.linalg.norm(velocity)) + 1e-9
    assert np.all(np.linalg.norm(speed, axis=-1)[:, 0, 0] <= allowed)
    if dt > 0.0:
        jerk = np.linalg.norm(np.diff(acc, axis=0), axis=-1)[:, 0, 0] / dt
        assert np.all(jerk <= J * (1.0 + 1e-6))
        # The displacement is the integral of the velocity.
        integral = np.sum((speed[1:] + speed[:-1]) / 2.0, axis=0) * dt
        np.testing.assert_allclose(x[-1], integral, atol=1e-5)
    _, end, rest = stop.at(stop.duration)
    assert not end.any()
    assert not rest.any()


def test_stop_from_speed_takes_v_over_a_plus_a_over_j() -> None:
    stop = Stop.plan(motion((0.5, 0.0, 0.0)), motion((0.0, 0.0, 0.0)), LIMITS)
    assert np.isclose(stop.duration, 0.5 / A + A / J)
    # A symmetric velocity profile covers half of speed times time.
    assert np.isclose(stop.at(stop.duration)[0][0, 0, 0], 0.5 * 0.5 * (0.5 / A + A / J))


def test_stop_does_not_depend_on_how_it_is_stepped() -> None:
    stop = Stop.plan(motion((0.2, -0.1, 0.3)), motion((1.0, 0.5, -0.4)), LIMITS)
    x, v, a = stop.at(0.1)
    again = Stop(v, a, stop.jerks, np.maximum(0.0, _left(stop, 0.1)))
    np.testing.assert_allclose(x + again.at(0.05)[0], stop.at(0.15)[0], atol=1e-12)


def test_stopping_states_end_exactly_at_rest_on_the_grid() -> None:
    moving = MotionState(
        np.zeros((1, 3)),
        poses.IDENTITY[None],
        motion((0.3, 0.0, 0.0)),
        motion((0.5, 0.2, 0.0)),
    )
    states = stopping_states(moving, LIMITS, 0.02)
    stop = Stop.plan(moving.twists, moving.accelerations, LIMITS)
    assert 0.02 * (len(states) - 1) < stop.duration <= 0.02 * len(states)
    assert states[-1].resting
    assert not states[-2].resting
    np.testing.assert_allclose(states[4].twists, stop.at(0.1)[1])
    np.testing.assert_allclose(states[-1].positions, stop.at(stop.duration)[0][:, 0])


def test_resting_grippers_need_no_stop() -> None:
    resting = MotionState.at_rest(Pose(np.zeros(3), poses.IDENTITY))
    assert len(stopping_states(resting, LIMITS, 0.02)) == 0


def _left(stop: Stop, t: float) -> np.ndarray:
    ends = np.cumsum(stop.durations, axis=0)
    return np.minimum(ends - t, stop.durations)
