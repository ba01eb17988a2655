"""Planar arm of two links of 0.5 m, with closed-form kinematics, for the tests of joints."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose

LINK = 0.5


class PlanarArm:
    """Arm in the plane z = 0.5 whose elbow bends to the positive side."""

    joint_range = np.array([[-3.0, -2.5], [3.0, 2.5]])
    max_joint_speed = np.full(2, np.inf)
    base_spheres = (np.array([[0.0, 0.0, 0.25]]), np.array([0.1]))

    def solve(self, grip: Pose, near: np.ndarray) -> np.ndarray | None:
        del near
        x, y = grip.position[:2]
        cosine = (x * x + y * y) / (2.0 * LINK**2) - 1.0
        if abs(cosine) > 1.0:
            return None
        elbow = np.arccos(cosine)
        return np.array([np.arctan2(y, x) - elbow / 2.0, elbow])

    def follow(
        self, positions: np.ndarray, orientations: np.ndarray, near: np.ndarray
    ) -> np.ndarray | None:
        rows = [self.solve(pose, near) for pose in map(Pose, positions, orientations)]
        found = [row for row in rows if row is not None]
        return np.array([near, *found]) if len(found) == len(rows) else None

    def smallest_singular_values(self, path: np.ndarray) -> np.ndarray:
        return np.linalg.svd([self.jacobian(row) for row in path], compute_uv=False)[:, -1]

    def joint_speed(self, joints: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return np.linalg.solve(self.jacobian(joints), velocity[0, :2])

    def link_spheres(self, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        elbows = LINK * np.array([[np.cos(row[0]), np.sin(row[0])] for row in path])
        return np.array([[[*elbow, 0.5]] for elbow in elbows]), np.array([0.05])

    def grip(self, joints: np.ndarray) -> Pose:
        first, second = joints[0], joints[0] + joints[1]
        x = LINK * np.array([np.cos(first) + np.cos(second), np.sin(first) + np.sin(second)])
        return Pose(np.array([*x, 0.5]), poses.IDENTITY)

    def jacobian(self, joints: np.ndarray) -> np.ndarray:
        first, second = joints[0], joints[0] + joints[1]
        outer = LINK * np.array([-np.sin(second), np.cos(second)])
        return np.stack([LINK * np.array([-np.sin(first), np.cos(first)]) + outer, outer], axis=1)
