"""Conversion between poses and the CR5's vectors [mm, deg], where R = Rz(rz) Ry(ry) Rx(rx)."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose

Vector = Float64[np.ndarray, "6"]
"""X, Y, Z [mm], Rx, Ry, Rz [deg]: rotations about the fixed axes, x first."""


def pose_from_vector(vector: Vector) -> Pose:
    """Convert a vector to a pose [m]."""
    x, y, z, *angles = np.asarray(vector, dtype=float).tolist()
    halves = [math.radians(angle) / 2.0 for angle in angles]
    (cx, cy, cz), (sx, sy, sz) = map(math.cos, halves), map(math.sin, halves)
    q = np.array(
        [
            cz * cy * cx + sz * sy * sx,
            cz * cy * sx - sz * sy * cx,
            cz * sy * cx + sz * cy * sx,
            sz * cy * cx - cz * sy * sx,
        ]
    )
    return Pose(np.array([x, y, z]) / 1e3, q)


def vector_from_pose(pose: Pose) -> Vector:
    """Convert a pose [m] to a vector; at |Ry| = 90 deg Rx is 0."""
    return vector_of(pose.position, poses.matrix(pose.orientation))


def vector_of(position: Float64[np.ndarray, "3"], R: Float64[np.ndarray, "3 3"]) -> Vector:
    """Convert a position [m] and a rotation matrix to a vector."""
    return np.concatenate([1e3 * position, np.degrees(poses.roll_pitch_yaw(R))])
