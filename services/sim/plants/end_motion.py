"""Motion of a grip between two reports of its arm.

A grip follows the cubic that meets both poses and both twists, so that the
rope undergoes no velocity step that its arms did not make.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose


@dataclass(frozen=True)
class EndMotion:
    """Pose and twist of a grip."""

    pose: Pose
    """Pose of the grip in the world: z along the rope, from left to right."""
    linear: Float64[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    """Velocity of the grip point in the world [m/s]."""
    angular: Float64[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    """Angular velocity in the world [rad/s]."""


def interpolate(
    start: EndMotion, end: EndMotion, duration: float, times: Float64[np.ndarray, "t"]
) -> tuple[Float64[np.ndarray, "t 3"], Float64[np.ndarray, "t 4"]]:
    """Positions [m] and orientations (wxyz) of a grip between two motions.

    Args:
        start: Motion at time 0.
        end: Motion after `duration`.
        duration: Time between the two [s].
        times: Times since the start [s].
    """
    turn = poses.multiply(end.pose.orientation, poses.conjugate(start.pose.orientation))
    s = times[:, None] / duration
    # Cubic Hermite weights of the end value and of both slopes; the start value is the origin.
    value, first, last = s * s * (3.0 - 2.0 * s), s * (s - 1.0) ** 2, s * s * (s - 1.0)
    shift = end.pose.position - start.pose.position
    rotation = poses.logarithm(turn)
    position = value * shift + duration * (first * start.linear + last * end.linear)
    vector = value * rotation + duration * (first * start.angular + last * end.angular)
    return (
        start.pose.position + position,
        poses.multiply(poses.exponential(vector), start.pose.orientation),
    )
