"""Poses of the emulated arm in its user and tool frames, as the protocol writes them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from services.cr5_emulator.geometry import Transform

Vector = Float64[np.ndarray, "6"]
"""X, Y, Z [mm], Rx, Ry, Rz [deg]: turns about the fixed axes, x first."""


def transform(vector: Vector) -> Transform:
    """The pose of a vector [m]."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(vector[3:])), np.sin(np.radians(vector[3:]))
    T = np.eye(4)
    T[:3, :3] = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    T[:3, 3] = np.asarray(vector[:3], dtype=float) / 1e3
    return T


def vector(T: Transform) -> Vector:
    """The vector of a pose; upright ones have Rx = 0."""
    level = np.hypot(T[0, 0], T[1, 0])
    ry = np.arctan2(-T[2, 0], level)
    if level > 1e-9:
        rx, rz = np.arctan2(T[2, 1], T[2, 2]), np.arctan2(T[1, 0], T[0, 0])
    else:
        rx, rz = 0.0, np.arctan2(-T[0, 1], T[1, 1])
    return np.concatenate([1e3 * T[:3, 3], np.degrees([rx, ry, rz])])


def quaternion(T: Transform) -> Float64[np.ndarray, "4"]:
    """w, x, y, z with w >= 0: the eigenvector of the largest eigenvalue (Bar-Itzhack)."""
    R = T[:3, :3]
    K = np.empty((4, 4))
    K[0, 0] = np.trace(R)
    K[0, 1:] = K[1:, 0] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    K[1:, 1:] = R + R.T - np.trace(R) * np.eye(3)
    q = np.linalg.eigh(K)[1][:, -1]
    return q if q[0] >= 0.0 else -q


def line(start: Transform, end: Transform, progress: float) -> Transform:
    """The pose part of the way on a straight line with an even turn."""
    T = np.eye(4)
    T[:3, 3] = start[:3, 3] + progress * (end[:3, 3] - start[:3, 3])
    T[:3, :3] = turned(start[:3, :3], end[:3, :3], progress)
    return T


def turned(start: np.ndarray, end: np.ndarray, progress: float) -> Float64[np.ndarray, "3 3"]:
    """The rotation part of the shortest way between two."""
    q = quaternion(_rotation(end @ start.T))
    angle = 2.0 * np.arctan2(np.linalg.norm(q[1:]), q[0]) * progress
    axis = q[1:] / max(float(np.linalg.norm(q[1:])), 1e-12)
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return (np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K) @ start


def _rotation(R: np.ndarray) -> Transform:
    T = np.eye(4)
    T[:3, :3] = R
    return T


def arc(start: Transform, through: Transform, end: Transform, full: bool) -> tuple:
    """A path on the circle through three points, and its length [m]; None when they are in line."""
    p, q, r = start[:3, 3], through[:3, 3], end[:3, 3]
    normal = np.cross(q - p, r - p)
    if np.linalg.norm(normal) < 1e-9:
        return None, 0.0
    # The centre is equally far from all three, in their plane.
    A = np.stack([q - p, r - p, normal])
    centre = np.linalg.solve(A, [(q @ q - p @ p) / 2.0, (r @ r - p @ p) / 2.0, normal @ p])
    x = p - centre
    y = np.cross(normal / np.linalg.norm(normal), x)
    radius = float(np.linalg.norm(x))
    angle = 2.0 * np.pi
    if not full:
        angle = float(np.arctan2((r - centre) @ y, (r - centre) @ x)) % (2.0 * np.pi)

    def path(progress: float) -> Transform:
        T = line(start, start if full else end, progress)
        T[:3, 3] = centre + np.cos(angle * progress) * x + np.sin(angle * progress) * y
        return T

    return path, radius * angle


def in_frames(flange: Transform, user: Vector, tool: Vector) -> Transform:
    """The tool's pose in the user frame for a flange pose in the base."""
    return np.linalg.inv(transform(user)) @ flange @ transform(tool)


def to_flange(pose: Transform, user: Vector, tool: Vector) -> Transform:
    """The flange pose in the base for a tool pose in the user frame."""
    return transform(user) @ pose @ np.linalg.inv(transform(tool))


def moved(pose: Transform, offset: Transform, along_itself: bool) -> Transform:
    """A pose shifted and turned along its own axes, or along those of its frame."""
    if along_itself:
        return pose @ offset
    T = pose.copy()
    T[:3, 3] += offset[:3, 3]
    T[:3, :3] = offset[:3, :3] @ pose[:3, :3]
    return T
