"""Poses of the flange in the base, and their vectors in the protocol."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from services.cr5_emulator.kinematics import Transform

Vector = Float64[np.ndarray, "6"]
"""X, Y, Z [mm], Rx, Ry, Rz [deg]: rotations about the fixed axes, x first."""


def transform(vector: Vector) -> Transform:
    """Convert a vector to a pose [m]."""
    angles = [math.radians(angle) for angle in vector[3:]]
    (cx, cy, cz), (sx, sy, sz) = map(math.cos, angles), map(math.sin, angles)
    T = np.eye(4)
    T[:3, :3] = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    T[:3, 3] = np.asarray(vector[:3], dtype=float) / 1e3
    return T


def vector(T: Transform) -> Vector:
    """Convert a pose to a vector; Rx is 0 where Ry is +-90 deg."""
    (a, b, _, x), (c, d, _, y), (e, f, g, z), _ = T.tolist()
    level = math.hypot(a, c)
    ry = math.atan2(-e, level)
    rx, rz = (math.atan2(f, g), math.atan2(c, a)) if level > 1e-9 else (0.0, math.atan2(-b, d))
    degrees = [math.degrees(angle) for angle in (rx, ry, rz)]
    return np.array([1e3 * x, 1e3 * y, 1e3 * z, *degrees])


def quaternion(T: Transform) -> Float64[np.ndarray, "4"]:
    """Return the orientation as wxyz with w >= 0."""
    return poses.from_matrix(T[:3, :3])


def interpolate(start: Transform, end: Transform, progress: float) -> Transform:
    """Interpolate: position on a straight line, rotation about a fixed axis at a constant rate."""
    T = np.eye(4)
    T[:3, 3] = start[:3, 3] + progress * (end[:3, 3] - start[:3, 3])
    T[:3, :3] = _interpolate_rotation(start[:3, :3], end[:3, :3], progress)
    return T


def _interpolate_rotation(
    start: np.ndarray, end: np.ndarray, progress: float
) -> Float64[np.ndarray, "3 3"]:
    """Return the rotation at a fraction of the shortest rotation between two."""
    q = poses.from_matrix(end @ start.T)
    angle = 2.0 * np.arctan2(np.linalg.norm(q[1:]), q[0]) * progress
    axis = q[1:] / max(float(np.linalg.norm(q[1:])), 1e-12)
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return (np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K) @ start


def offset_pose(pose: Transform, offset: Transform, in_own_frame: bool) -> Transform:
    """Apply an offset in the pose's own frame, or in the axes of its reference frame."""
    if in_own_frame:
        return pose @ offset
    T = pose.copy()
    T[:3, 3] += offset[:3, 3]
    T[:3, :3] = offset[:3, :3] @ pose[:3, :3]
    return T
