"""Motion of a grip between two reports of its arm.

A grip follows the cubic that meets both poses and both twists, so that the
rope undergoes no velocity step that its arms did not make.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    starts: Sequence[EndMotion],
    ends: Sequence[EndMotion],
    duration: float,
    times: Float64[np.ndarray, "t"],
) -> tuple[Float64[np.ndarray, "k t 3"], Float64[np.ndarray, "k t 4"]]:
    """Positions [m] and orientations (wxyz) of k grips between two motions of each.

    Args:
        starts: Motions at time 0.
        ends: Motions after `duration`.
        duration: Time between the two [s].
        times: Times since the start [s].
    """
    p, q, v, w = _columns(starts)
    p_end, q_end, v_end, w_end = _columns(ends)
    s = times[:, None] / duration
    # Cubic Hermite weights of the end value and of both slopes; the start value is the origin.
    value, first, last = s * s * (3.0 - 2.0 * s), s * (s - 1.0) ** 2, s * s * (s - 1.0)
    rotation = poses.rotation_from(q, q_end)
    shift = value * (p_end - p) + duration * (first * v + last * v_end)
    if not (rotation.any() or w.any() or w_end.any()):
        return p + shift, np.repeat(q, len(times), axis=1)
    vector = value * rotation + duration * (first * w + last * w_end)
    return p + shift, poses.multiply(poses.exponential(vector), q)


def _columns(motions: Sequence[EndMotion]) -> list[np.ndarray]:
    """Positions, orientations, velocities and angular velocities, each (k, 1, ·)."""
    rows = [(m.pose.position, m.pose.orientation, m.linear, m.angular) for m in motions]
    return [np.array(column)[:, None] for column in zip(*rows, strict=True)]
