"""Conversion between poses and the CR5's vectors [mm, deg], where R = Rz(rz) Ry(ry) Rx(rx)."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose


def pose_from_vector(vector: Float64[np.ndarray, "6"]) -> Pose:
    """Convert X, Y, Z [mm], Rx, Ry, Rz [deg] to a pose [m]."""
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


def vector_from_pose(pose: Pose) -> Float64[np.ndarray, "6"]:
    """Convert a pose [m] to X, Y, Z [mm], Rx, Ry, Rz [deg]; at |Ry| = 90 deg Rx is 0."""
    R = poses.matrix(pose.orientation)
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if np.hypot(R[0, 0], R[1, 0]) < 1e-9:
        roll, yaw = 0.0, np.arctan2(-R[0, 1], R[1, 1])
    else:
        roll, yaw = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(R[1, 0], R[0, 0])
    return np.concatenate([1e3 * pose.position, np.degrees([roll, pitch, yaw])])
