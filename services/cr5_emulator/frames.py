"""Poses of the flange in the base, and their vectors in the protocol."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from services.cr5_emulator.kinematics import Transform
from shared.cr5.pose_vectors import Vector, pose_from_vector


def transform(vector: Vector) -> Transform:
    """Convert a vector to a pose [m]."""
    return _transform(pose_from_vector(vector))


def _transform(pose: Pose) -> Transform:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = poses.matrix(pose.orientation), pose.position
    return T


def interpolate(start: Transform, end: Transform, progress: float) -> Transform:
    """Interpolate: position on a straight line, rotation about a fixed axis at a constant rate."""
    ends = (Pose(T[:3, 3], poses.from_matrix(T[:3, :3])) for T in (start, end))
    return _transform(poses.interpolate(*ends, progress))


def offset_pose(pose: Transform, offset: Transform, in_own_frame: bool) -> Transform:
    """Apply an offset in the pose's own frame, or in the axes of its reference frame."""
    if in_own_frame:
        return pose @ offset
    T = pose.copy()
    T[:3, 3] += offset[:3, 3]
    T[:3, :3] = offset[:3, :3] @ pose[:3, :3]
    return T
