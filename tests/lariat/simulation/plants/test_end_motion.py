from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.simulation.plants.end_motion import EndMotion, interpolate

ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
LEFT = Pose(np.array([-0.18, 0.0, 0.3]), ALONG_X)


def test_a_grip_meets_both_poses_and_both_twists() -> None:
    turned = poses.multiply(poses.exponential(np.array([0.0, 0.2, 0.1])), ALONG_X)
    start = EndMotion(LEFT, np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, 0.3]))
    end = EndMotion(
        Pose(LEFT.position + 0.02, turned), np.array([0.0, -0.1, 0.2]), np.array([0.1, 0.2, 0.3])
    )
    tiny = 1e-6
    times = np.array([0.0, tiny, 0.1, 0.1 + tiny])
    # Beside another grip, which stands.
    still = EndMotion(LEFT)
    both = interpolate((still, start), (still, end), 0.1, times)
    np.testing.assert_array_equal(both[0][0], np.tile(LEFT.position, (4, 1)))
    positions, orientations = both[0][1], both[1][1]
    turns = poses.multiply(orientations[1::2], poses.conjugate(orientations[::2]))
    rates = poses.logarithm(turns) / tiny
    for k, motion in enumerate((start, end)):
        here = 2 * k
        np.testing.assert_allclose(positions[here], motion.pose.position, atol=1e-12)
        np.testing.assert_allclose(
            np.abs(orientations[here] @ motion.pose.orientation), 1.0, atol=1e-12
        )
        rate = (positions[here + 1] - positions[here]) / tiny
        np.testing.assert_allclose(rate, motion.linear, atol=1e-4)
    np.testing.assert_allclose(rates[0], start.angular, atol=1e-4)
