from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.perception.tracking.grip_history import CLOCK_RESET_STEP, GripHistory

MS = 1_000_000


def at(x: float, yaw: float = 0.0) -> Pose:
    return Pose(np.array([x, 0.0, 0.0]), poses.exponential(np.array([0.0, 0.0, yaw])))


def test_poses_between_two_states_are_interpolated() -> None:
    history = GripHistory()
    history.add(100 * MS, at(0.0), at(1.0))
    history.add(108 * MS, at(0.8, 0.4), at(1.0))
    left, right = history.at(102 * MS)
    assert left is not None
    assert right is not None
    np.testing.assert_allclose(left.position, [0.2, 0.0, 0.0])
    np.testing.assert_allclose(poses.logarithm(left.orientation), [0.0, 0.0, 0.1], atol=1e-12)
    np.testing.assert_allclose(right.position, [1.0, 0.0, 0.0])


def test_outside_the_history_the_nearest_state_is_returned() -> None:
    history = GripHistory()
    assert history.at(0) == (None, None)
    history.add(100 * MS, at(0.0), at(1.0))
    history.add(108 * MS, at(0.8), at(1.0))
    for stamp, x in ((0, 0.0), (200 * MS, 0.8)):
        left, _ = history.at(stamp)
        assert left is not None
        assert left.position[0] == x


def test_a_restarted_clock_clears_the_history() -> None:
    history = GripHistory()
    history.add(5 * CLOCK_RESET_STEP, at(0.0), at(1.0))
    history.add(5 * CLOCK_RESET_STEP - MS, at(0.5), at(1.0))
    left, _ = history.at(5 * CLOCK_RESET_STEP)
    assert left is not None
    assert left.position[0] == 0.0
    history.add(3 * CLOCK_RESET_STEP, at(0.5), at(1.0))
    assert history.at(3 * CLOCK_RESET_STEP) == (None, None)
