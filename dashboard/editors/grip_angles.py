"""Orientation of a grip as three angles that a person can name.

The angles are those of the rope's direction at the grip, z of the gripper's frame: yaw turns it in
the horizontal plane, from the world's x axis towards y; pitch lifts it above that plane; roll turns
the gripper about it. All are zero for a level grip along x.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.scenario.goal_table import LEVEL_GRIP

MIN_HORIZONTAL = 1e-9
"""Horizontal part of the rope's direction below which it counts as vertical [-]; its yaw is then
zero, and all turning about the vertical is roll."""


def grip_angles(orientation: Float64[np.ndarray, "4"]) -> Float64[np.ndarray, "3"]:
    """Return yaw, pitch and roll of a grip [rad]."""
    turned = poses.multiply(np.asarray(orientation), poses.conjugate(LEVEL_GRIP))
    x, y, z = poses.matrix(turned)[:, 0]
    horizontal = math.hypot(x, y)
    yaw = math.atan2(y, x) if horizontal > MIN_HORIZONTAL else 0.0
    pitch = math.atan2(z, horizontal)
    rest = poses.multiply(poses.conjugate(_direction(yaw, pitch)), turned)
    return np.array([yaw, pitch, poses.logarithm(rest)[0]])


def grip_orientation(angles: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "4"]:
    """Return the orientation of a grip, wxyz, of yaw, pitch and roll [rad]."""
    yaw, pitch, roll = (float(a) for a in angles)
    about_rope = poses.exponential(np.array([roll, 0.0, 0.0]))
    return poses.multiply(poses.multiply(_direction(yaw, pitch), about_rope), LEVEL_GRIP)


def _direction(yaw: float, pitch: float) -> Float64[np.ndarray, "4"]:
    """Rotation that turns the world's x axis to a yaw and a pitch."""
    heading = poses.exponential(np.array([0.0, 0.0, yaw]))
    return poses.multiply(heading, poses.exponential(np.array([0.0, -pitch, 0.0])))
