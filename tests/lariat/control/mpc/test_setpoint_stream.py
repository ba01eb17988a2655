"""Continuity of successive chunks."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.mpc.setpoint_stream import STOP_POINTS, SetpointStream
from lariat.safety.motion_contract import LEAST_CHUNK_SPAN
from lariat.scenario.sections import Limits
from lariat.trajectory import MotionSequence, MotionState, stopping_states
from tests.services.controller.cell import grips

REST = MotionState.at_rest(*grips((-0.2, 0.0, 0.3), (0.2, 0.0, 0.3)))


def sequence(states: list[MotionState]) -> MotionSequence:
    return MotionSequence.joined(*(MotionSequence.constant(state, 1) for state in states))


def test_every_chunk_repeats_the_points_before_its_new_ones() -> None:
    dt = 20_000_000
    stream = SetpointStream(REST, 0, dt, Limits().scaled(0.7))
    jerk = np.full((2, 2, 3), 1.0)
    motions = [REST]
    for _ in range(5):
        v, a = motions[-1].twists, motions[-1].accelerations
        h = dt * 1e-9
        motions.append(
            motions[-1].moved(
                h * (v + h * (a / 2.0 + h * jerk / 6.0)), v + h * (a + h * jerk / 2.0), a + h * jerk
            )
        )
    commit = stream.index_at(30_000_000)
    first = stream.extended(commit, sequence(motions[1:]))
    second = stream.continued(commit + 1)
    assert second.start - first.start == dt
    repeated = len(first.positions) - 1
    np.testing.assert_array_equal(first.positions[1:], second.positions[:repeated])
    np.testing.assert_array_equal(first.positions[-2], first.positions[-1])
    assert first.span >= LEAST_CHUNK_SPAN
    halfway = stream.motion_at(stream.time_of(commit + 2) + dt // 2).positions
    ends = [stream.motion(commit + k).positions for k in (2, 3)]
    assert np.all((halfway - ends[0]) * (halfway - ends[1]) < 0.0)


def test_chunk_without_new_motions_stops_sooner_than_the_published_one() -> None:
    dt, limits = 20_000_000, Limits()
    stream = SetpointStream(REST, 0, dt, limits)
    commit = stream.index_at(30_000_000)
    velocity = np.zeros((2, 2, 3))
    velocity[:, 0, 0] = 0.2
    moving = [
        MotionState(
            REST.positions + velocity[:, 0] * 0.02 * k,
            REST.orientations,
            velocity,
            REST.accelerations,
        )
        for k in range(1, 14)
    ]
    published = stream.extended(commit, sequence(moving)).positions[-1, 0, 0]
    stopped = stream.extended(commit + 1).positions[-1, 0, 0]
    begun = moving[0].positions[0, 0]
    # From 0.2 m/s with 2 m/s^2, limited in jerk: 10 mm and a little more.
    assert 0.010 < stopped - begun < 0.016
    assert published - stopped > 0.04


# The limits alone, 2 m/s^2 and 40 m/s^3, stop 0.02 m/s in 0.045 s with 0.9 m/s^2, 0.5 m/s in 0.3 s.
@pytest.mark.parametrize(
    ("speed", "duration", "peak"), [(0.0, 0.0, 0.0), (0.02, 0.25, 0.16), (0.5, 0.3, 2.0)]
)
def test_setpoints_end_gently_where_they_are_slow(
    speed: float, duration: float, peak: float
) -> None:
    stream = SetpointStream(REST, 0, 20_000_000, Limits())
    velocity = np.zeros((2, 2, 3))
    velocity[1, 0, 2] = speed
    moving = MotionState(REST.positions, REST.orientations, velocity, REST.accelerations)
    last = stream.index_at(30_000_000) + 1
    stream.extended(last - 1, sequence([moving]))
    states = [stream.motion(last + k) for k in range(25)]
    assert sum(np.any(s.twists) for s in states) == pytest.approx(duration / 0.02, abs=1.0)
    accelerations = [-s.accelerations[1, 0, 2] for s in states]
    assert max(accelerations) == pytest.approx(peak, rel=0.1)


@pytest.mark.parametrize(("share", "scale"), [(1.0, 0.1), (1.0, 0.0), (0.01, 0.3)])
def test_stop_is_that_of_its_formula(share: float, scale: float) -> None:
    random, limits = np.random.default_rng(0), Limits().scaled(share)
    twists, accelerations = scale * random.normal(size=(2, 2, 2, 3))
    accelerations[1], twists[0, 1] = 0.0, 0.0
    moving = MotionState(REST.positions, REST.orientations, twists, accelerations)
    stream = SetpointStream(moving, 0, 20_000_000, limits)
    stream.extended(stream.index_at(0))
    expected = stopping_states(moving, limits, 0.02)
    assert (len(expected) > STOP_POINTS) == (share < 1.0)
    for k in range(len(expected)):
        state = stream.motion(stream.index_at(0) + 1 + k)
        np.testing.assert_allclose(state.positions, expected[k].positions, atol=1e-12)
        np.testing.assert_allclose(state.orientations, expected[k].orientations, atol=1e-12)
        np.testing.assert_allclose(state.twists, expected[k].twists, atol=1e-12)
        np.testing.assert_allclose(state.accelerations, expected[k].accelerations, atol=1e-11)
    assert stream.resting_from(stream.index_at(0) + max(len(expected), 1))
