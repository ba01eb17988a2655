"""What plays the real rope: something whose ends are moved and whose nodes can be asked for.

A plant never sees a setpoint, only where the grips are and how they move; between two reports the
grips follow the cubic that meets both poses and both twists, so that a rope never feels a velocity
step that its arms did not make.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose


@dataclass(frozen=True)
class EndMotion:
    """Where a grip is and how it moves."""

    pose: Pose
    """Of the grip: z along the rope, from left to right."""
    linear: Float64[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    """Velocity of the grip point in the world [m/s]."""
    angular: Float64[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    """Angular velocity in the world [rad/s]."""


class Plant(Protocol):
    """A rope with both ends held, among obstacles."""

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Where the rope is now, left end first [m]."""
        ...

    def reset(
        self, left: Pose, right: Pose, guess: Float64[np.ndarray, "m 3"] | None = None
    ) -> None:
        """Puts the rope at rest between two grips, near `guess` where several rests exist."""
        ...

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replaces everything that the rope can touch."""
        ...

    def step(self, left: EndMotion, right: EndMotion, duration: float) -> None:
        """Moves the grips there within `duration` [s] and the rope with them."""
        ...


def way(
    start: EndMotion, end: EndMotion, duration: float, times: Float64[np.ndarray, "t"]
) -> tuple[Float64[np.ndarray, "t 3"], Float64[np.ndarray, "t 4"]]:
    """Positions [m] and orientations of a grip on its way.

    Args:
        start: Where it was and how it moved.
        end: Where it arrives and how it then moves.
        duration: Between the two [s].
        times: Since the start [s].
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


def slack_curve(
    left: Pose, right: Pose, length: float, count: int
) -> Float64[np.ndarray, "count 3"]:
    """A curve of about the given length that leaves both grips along their directions [m].

    The tangents of a cubic grow until it is long enough; where they cannot, because both grips
    point along their connecting line, it sags.
    """
    a, b = left.position, right.position
    z = np.array([0.0, 0.0, 1.0])
    first, last = poses.rotate(left.orientation, z), poses.rotate(right.orientation, z)
    chord = float(np.linalg.norm(b - a))
    sag = np.array([0.0, 0.0, -1.0]) * 0.6 * np.sqrt(max(length**2 - chord**2, 0.0))
    t = np.linspace(0.0, 1.0, 20 * count)[:, None]
    value, rise, fall = t * t * (3.0 - 2.0 * t), t * (t - 1.0) ** 2, t * t * (t - 1.0)

    def curve(weight: float, pull: float) -> Float64[np.ndarray, "m 3"]:
        slopes = weight * length * (rise * first + fall * last)
        return a + value * (b - a) + slopes + 4.0 * t * (1.0 - t) * pull * sag

    def span(nodes: Float64[np.ndarray, "m 3"]) -> float:
        return float(np.sum(np.linalg.norm(np.diff(nodes, axis=0), axis=1)))

    low, high = 0.0, 3.0
    for _ in range(30):
        middle = (low + high) / 2.0
        low, high = (middle, high) if span(curve(0.5, middle)) < length else (low, middle)
    path = curve(0.5, low)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, s[-1], count)
    return np.stack([np.interp(at, s, path[:, k]) for k in range(3)], axis=1)
