"""How the grips may move: jerk-limited motion on a grid of instants.

Both grips together are one motion: row 0 is the left one; of the middle axis of velocities,
accelerations and jerks, entry 0 is translation and entry 1 rotation, in the world frame. Between
two instants of the grid the jerk is constant, so limits that hold at the instants hold everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from shared.scenario.sections import Limits

Vectors = Float64[np.ndarray, "2 2 3"]


@dataclass(frozen=True)
class Bounds:
    """Limits on the norms of each grip's translation and rotation, shape (2, 1)."""

    speed: Float64[np.ndarray, "2 1"]
    """[m/s], [rad/s]"""
    acceleration: Float64[np.ndarray, "2 1"]
    """[m/s^2], [rad/s^2]"""
    jerk: Float64[np.ndarray, "2 1"]
    """[m/s^3], [rad/s^3]"""

    @classmethod
    def share(cls, limits: Limits, fraction: float) -> Bounds:
        """A fraction of what the grippers are allowed."""
        return cls(
            fraction * np.array([[limits.speed], [limits.angular_speed]]),
            fraction * np.array([[limits.acceleration], [limits.angular_acceleration]]),
            fraction * np.array([[limits.jerk], [limits.angular_jerk]]),
        )


@dataclass(frozen=True)
class Motion:
    """Where the grips are and how they move at one instant."""

    positions: Float64[np.ndarray, "2 3"]
    """[m]"""
    orientations: Float64[np.ndarray, "2 4"]
    """wxyz"""
    velocity: Vectors
    """[m/s], [rad/s]"""
    acceleration: Vectors
    """[m/s^2], [rad/s^2]"""

    @classmethod
    def at_rest(cls, left: Pose, right: Pose) -> Motion:
        """Standing still."""
        still = np.zeros((2, 2, 3))
        return cls(
            np.stack([left.position, right.position]),
            np.stack([left.orientation, right.orientation]),
            still,
            still,
        )

    @property
    def grips(self) -> tuple[Pose, Pose]:
        """Left and right."""
        return (
            Pose(self.positions[0], self.orientations[0]),
            Pose(self.positions[1], self.orientations[1]),
        )

    @property
    def resting(self) -> bool:
        """Whether nothing moves."""
        return not (self.velocity.any() or self.acceleration.any())

    def moved(self, displacement: Vectors, velocity: Vectors, acceleration: Vectors) -> Motion:
        """After a displacement of translation [m] and rotation [rad]."""
        return Motion(
            self.positions + displacement[:, 0],
            poses.normalized(
                poses.multiply(poses.exponential(displacement[:, 1]), self.orientations)
            ),
            velocity,
            acceleration,
        )


def twist_between(before: Motion, after: Motion, dt: float) -> Vectors:
    """Mean linear and angular velocity of the grips over `dt` [s]."""
    turned = poses.multiply(after.orientations, poses.conjugate(before.orientations))
    return np.stack([after.positions - before.positions, poses.logarithm(turned)], axis=1) / dt


def jerk_towards(
    velocity: Vectors,
    acceleration: Vectors,
    wanted: Vectors,
    wanted_change: Vectors,
    bounds: Bounds,
    dt: float,
) -> Vectors:
    """Constant jerk over the next `dt` [s] that leads the velocity to a wanted one.

    The error in velocity asks for an acceleration, linear near zero and as its square root further
    out, so that the jerk can always take it away again in time.

    Args:
        wanted: Velocity to lead to.
        wanted_change: Its rate of change, as feed-forward.
    """
    error = clipped(wanted, bounds.speed) - velocity
    size = np.maximum(_norm(error), 1e-12)
    gain = np.minimum(0.3 / dt, np.sqrt(bounds.jerk / size))
    asked = clipped(wanted_change + gain * error, bounds.acceleration)
    return clipped((asked - acceleration) / dt, bounds.jerk)


def stop(motion: Motion, bounds: Bounds, dt: float) -> list[Motion]:
    """The motion at the instants after this one until both grips rest.

    The acceleration is taken away along its own direction first; what speed is left is shed along
    its own line with a trapezoid of deceleration.
    """
    v, a = motion.velocity, motion.acceleration
    ease = _norm(a) / bounds.jerk
    peak = v + a * ease / 2.0
    speed = _norm(peak)
    ramp = np.minimum(bounds.acceleration / bounds.jerk, np.sqrt(speed / bounds.jerk))
    hold = np.maximum(speed / np.maximum(bounds.jerk * ramp, 1e-12) - ramp, 0.0)
    back = -peak / np.maximum(speed, 1e-12) * bounds.jerk
    jerks = (-a / np.maximum(_norm(a), 1e-12) * bounds.jerk, back, np.zeros_like(back), -back)
    durations = (ease, ramp, hold, ramp)
    total = float(np.max(sum(durations)))
    instants = []
    count = int(np.ceil(total / dt - 1e-9))
    for t in dt * np.arange(1, count + 1):
        moved, velocity, acceleration, left = np.zeros_like(v), v, a, np.asarray(t)
        for jerk, duration in zip(jerks, durations, strict=True):
            tau = np.clip(left, 0.0, duration)
            left = left - duration
            moved = moved + tau * (velocity + tau * (acceleration / 2.0 + tau * jerk / 6.0))
            velocity = velocity + tau * (acceleration + tau * jerk / 2.0)
            acceleration = acceleration + tau * jerk
        # The phases add up to rest but for rounding; rest is exact.
        over = left >= 0.0 if t < count * dt else np.ones_like(left, dtype=bool)
        instants.append(
            motion.moved(moved, np.where(over, 0.0, velocity), np.where(over, 0.0, acceleration))
        )
    return instants


def clipped(vectors: Vectors, bound: Float64[np.ndarray, "2 1"]) -> Vectors:
    """Vectors no longer than their bound, in their own direction."""
    return vectors * np.minimum(1.0, bound / np.maximum(_norm(vectors), 1e-300))


def _norm(vectors: Vectors) -> Float64[np.ndarray, "2 2 1"]:
    return np.sqrt(np.einsum("nij,nij->ni", vectors, vectors))[..., None]
