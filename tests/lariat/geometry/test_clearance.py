"""Near pairs are those that the signed distances imply."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.clearance import near_pairs
from lariat.geometry.grippers import gripper_points, swept_gripper_points
from lariat.geometry.obstacles import TABLE, Obstacle, signed_distance
from lariat.geometry.poses import Pose

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])


def test_near_pairs_are_those_within_reach() -> None:
    points = np.random.default_rng(0).uniform(-0.2, 0.2, size=(200, 3))
    obstacles = (TABLE, Obstacle("sphere", (0.0, 0.0, 0.1), radius=0.05))
    found = near_pairs(points, obstacles, np.full(200, 0.03))
    expected = sum(int(np.sum(signed_distance(points, o) < 0.03)) for o in obstacles)
    assert len(found.points) == expected > 10
    # A step along the normals gains its own length.
    for k, distance, normal in zip(found.points, found.distances, found.normals, strict=True):
        moved = points[k] + 1e-6 * normal
        gains = [float(signed_distance(moved[None], o)[0]) - distance for o in obstacles]
        assert min(abs(g - 1e-6) for g in gains) < 1e-9


def test_grippers_point_away_from_the_rope() -> None:
    left, right = Pose(np.array([-0.2, 0, 0.3]), LEVEL), Pose(np.array([0.2, 0, 0.3]), LEVEL)
    points = gripper_points(left, right, 0.06)
    assert np.allclose(points[[0, 2, 3, 5], 0], [-0.2, -0.26, 0.2, 0.26])
    turned = poses.multiply(poses.exponential(np.array([0.3, -0.2, 0.5])), LEVEL)
    other = Pose(np.array([0.1, 0.1, 0.2]), turned)
    swept = swept_gripper_points(
        np.array([[left.position, right.position], [left.position, other.position]]),
        np.array([[LEVEL, LEVEL], [LEVEL, turned]]),
        0.06,
    )
    assert np.allclose(swept, np.concatenate([points, gripper_points(left, other, 0.06)]))
