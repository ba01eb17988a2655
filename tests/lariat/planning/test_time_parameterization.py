from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lariat.geometry import poses
from lariat.geometry.grips import Grips
from lariat.planning.time_parameterization import Pace, time_parameterize
from lariat.safety.motion_contract import PATH_LIMIT_SHARE
from lariat.scenario.sections import Limits

DT = 0.02


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 12), st.floats(0.001, 0.5))
def test_timed_path_keeps_limits_and_rests_at_both_ends(seed: int, count: int, size: float) -> None:
    random = np.random.default_rng(seed)
    limits = Limits()
    waypoints = size * random.normal(size=(count, 2, 3))
    turns = np.cumsum(0.5 * random.normal(size=(count, 2, 3)), axis=0)
    orientations = poses.exponential(turns)
    path = time_parameterize(Grips(waypoints, orientations), limits, DT, Pace())
    positions, turned = path.positions, path.orientations
    assert np.allclose(positions[[0, -1]], waypoints[[0, -1]], atol=1e-12)
    last = poses.multiply(turned[-1], poses.conjugate(orientations[-1]))
    assert np.linalg.norm(poses.logarithm(last), axis=1).max() < 1e-9
    still = np.concatenate([positions[:1]] * 3 + [positions] + [positions[-1:]] * 3)
    for order, bound in enumerate((limits.speed, limits.acceleration, limits.jerk), start=1):
        change = np.linalg.norm(np.diff(still, n=order, axis=0), axis=2) / DT**order
        assert change.max() <= PATH_LIMIT_SHARE * bound * 1.01


def test_slower_path_takes_longer() -> None:
    waypoints = np.array([[[0.0, 0, 0], [0.4, 0, 0]], [[0.0, 0.3, 0], [0.4, 0.3, 0]]])
    level = Grips(waypoints, np.tile(poses.IDENTITY, (2, 2, 1)))
    quick, slow = (time_parameterize(level, Limits(), DT, Pace(down)) for down in (1.0, 2.0))
    assert len(quick) < 100
    assert 1.6 * len(quick) < len(slow) < 2.2 * len(quick)


def test_turns_of_twist_are_kept_while_the_end_tilts() -> None:
    limits = Limits()
    s = np.linspace(0.0, 1.0, 40)[:, None]
    tilt = poses.exponential(s * np.array([0.3, 0.9, 0.2]))
    spin = poses.exponential(4.0 * np.pi * s * np.array([0.0, 0.0, 1.0]))
    right = poses.multiply(tilt, spin)
    left = np.broadcast_to(poses.IDENTITY, right.shape)
    waypoints = Grips(np.zeros((40, 2, 3)) + 0.1 * s[:, None], np.stack([left, right], axis=1))
    turned = time_parameterize(waypoints, limits, DT, Pace()).orientations
    steps = poses.logarithm(poses.multiply(turned[1:, 1], poses.conjugate(turned[:-1, 1])))
    about = np.sum(
        steps * poses.rotate(turned[1:, 1], np.broadcast_to([0.0, 0.0, 1.0], steps.shape)), axis=1
    )
    assert abs(np.sum(about) - 4.0 * np.pi) < 0.5
    last = poses.multiply(turned[-1, 1], poses.conjugate(right[-1]))
    assert np.linalg.norm(poses.logarithm(last)) < 1e-9
    rate = np.concatenate([np.zeros((3, 3)), steps / DT, np.zeros((3, 3))])
    for bound in (limits.angular_speed, limits.angular_acceleration, limits.angular_jerk):
        assert np.linalg.norm(rate, axis=1).max() <= PATH_LIMIT_SHARE * bound * 1.01
        rate = np.diff(rate, axis=0) / DT


def test_corners_with_little_room_are_cut_by_no_more_than_their_share() -> None:
    corner = np.array([[0.0, 0, 0], [0.2, 0, 0], [0.2, 0.2, 0]])
    waypoints = np.stack([corner, corner + np.array([0.0, 0.0, 0.3])], axis=1)
    level = Grips(waypoints, np.tile(poses.IDENTITY, (3, 2, 1)))
    room = np.array([0.1, 0.002, 0.1])
    cuts, durations = [], []
    for share in (np.inf, 0.5):
        pace = Pace(1.3, (0.16, 0.1), share)
        path = time_parameterize(level, Limits(), DT, pace, room)
        cuts.append(float(np.linalg.norm(path.positions[:, 0] - corner[1], axis=1).min()))
        durations.append(len(path) * DT)
    assert cuts[0] > 0.003
    assert cuts[1] <= 0.5 * 0.002
    assert durations[1] < 2.0 * 12.0 * durations[0]


def test_a_straight_path_is_as_fast_with_little_room() -> None:
    line = np.linspace([0.0, 0, 0], [0.4, 0, 0], 9)
    waypoints = np.stack([line, line + np.array([0.0, 0.0, 0.3])], axis=1)
    level, pace = Grips(waypoints, np.tile(poses.IDENTITY, (9, 2, 1))), Pace(1.3, (0.16, 0.1), 0.1)
    paths = [
        time_parameterize(level, Limits(), DT, pace, np.full(9, room)).positions
        for room in (1.0, 1e-3)
    ]
    assert np.array_equal(*paths)
