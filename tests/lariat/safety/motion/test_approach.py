from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.safety.motion.approach import (
    SETTINGS,
    approach_chunk,
    is_as_named,
    is_away,
    pose_difference,
)
from lariat.trajectory import Spline

NOW = 1_000_000_000
START = Pose(np.array([0.1, 0.2, 0.3]), poses.IDENTITY)


def displaced(distance: float, angle: float = 0.0) -> Pose:
    turn = poses.exponential(np.array([0.0, angle, 0.0]))
    return Pose(START.position + np.array([0.0, 0.0, distance]), turn)


def test_difference_of_poses_is_a_distance_and_an_angle() -> None:
    np.testing.assert_allclose(pose_difference(START, displaced(0.3, 0.4)), (0.3, 0.4))


@pytest.mark.parametrize(
    ("distance", "angle", "away"),
    [(0.0, 0.0, False), (0.0199, 0.0, False), (0.0201, 0.0, True), (0.0, 0.099, False),
     (0.0, 0.101, True)],
)  # fmt: skip
def test_arm_is_away_beyond_either_tolerance(distance: float, angle: float, away: bool) -> None:
    assert is_away(displaced(distance, angle), START) is away


@pytest.mark.parametrize("pace", [1.0, 0.25])
@pytest.mark.parametrize(("distance", "angle"), [(0.4, 0.0), (0.001, 0.0), (0.1, 1.5)])
def test_approach_ends_at_rest_at_the_goal_and_is_slow(
    distance: float, angle: float, pace: float
) -> None:
    chunk = approach_chunk([START], [displaced(distance, angle)], NOW, pace)
    np.testing.assert_allclose(chunk.positions[-1, 0], displaced(distance).position)
    np.testing.assert_array_equal(chunk.positions[-1], chunk.positions[-2])
    spline = Spline(chunk, NOW)
    speed, turning = spline.differences(1).max(axis=(0, 1))
    assert speed <= pace * SETTINGS.speed * 1.001
    assert turning <= pace * SETTINGS.angular_speed * 1.001
    assert len(chunk.positions) <= SETTINGS.max_intervals + 3


@pytest.mark.parametrize(
    ("named", "same"),
    [((0.334, 1.57), True), ((0.338, 1.56), True), ((0.33, 1.5), False), ((0.0, 0.0), False)],
)
def test_approach_is_as_a_person_named_it_within_a_tolerance(
    named: tuple[float, float], same: bool
) -> None:
    assert is_as_named(named, (0.334, 1.57)) is same
