from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import MotionState, mean_twists

REST = MotionState.at_rest(
    Pose(np.array([-0.2, 0.0, 0.3]), poses.IDENTITY),
    Pose(np.array([0.2, 0.0, 0.3]), np.array([0.5, 0.5, 0.5, 0.5])),
)


def test_state_at_rest_has_the_poses_that_it_is_made_of() -> None:
    left, right = REST.grips
    assert REST.resting
    np.testing.assert_array_equal(left.position, [-0.2, 0.0, 0.3])
    np.testing.assert_array_equal(right.orientation, [0.5, 0.5, 0.5, 0.5])


def test_state_of_no_grippers_has_empty_arrays() -> None:
    empty = MotionState.at_rest()
    assert empty.resting
    assert empty.positions.shape == (0, 3)
    assert empty.orientations.shape == (0, 4)
    assert empty.twists.shape == (0, 2, 3)


def test_acceleration_alone_is_not_rest() -> None:
    still = np.zeros((2, 2, 3))
    pushed = still.copy()
    pushed[1, 0, 2] = 1e-9
    assert not REST.moved(still, still, pushed).resting


def test_mean_twists_lead_from_one_state_to_the_other() -> None:
    displacements = np.random.default_rng(0).normal(scale=0.3, size=(2, 2, 3))
    still = np.zeros((2, 2, 3))
    moved = REST.moved(displacements, still, still)
    np.testing.assert_allclose(0.02 * mean_twists(REST, moved, 0.02), displacements, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(moved.orientations, axis=1), 1.0, rtol=1e-15)
