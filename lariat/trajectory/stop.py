"""The stop that is always ready: jerk-limited, straight, in closed form.

From velocity v and acceleration a the acceleration is first taken away along its own direction,
which needs |a| / J; what speed remains is then shed along its own line with the trapezoid of
deceleration that the limits A and J allow, which needs at most v / A + A / J.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.trajectory.limits import LimitTable

Vectors = Float64[np.ndarray, "n 2 3"]


def _norm(vectors: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b 1"]:
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))[..., None]


def _direction(vectors: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b 3"]:
    return vectors / np.maximum(_norm(vectors), 1e-300)


def peak_velocity(velocity: Vectors, acceleration: Vectors, limits: LimitTable) -> Vectors:
    """Velocity when a stop has taken the acceleration away.

    The velocity moves on a straight line until then, so the speed during a stop never exceeds the
    larger of this one's and the present one's.
    """
    return velocity + acceleration * _norm(acceleration) / (2.0 * limits.jerk)


@dataclass(frozen=True)
class Stop:
    """A stop of all grippers, every one as quick as its own limits allow."""

    velocity: Vectors
    """When it begins [m/s, rad/s]."""
    acceleration: Vectors
    """When it begins [m/s^2, rad/s^2]."""
    jerks: Float64[np.ndarray, "4 n 2 3"]
    """In its four phases [m/s^3, rad/s^3]."""
    durations: Float64[np.ndarray, "4 n 2 1"]
    """Of the phases [s]."""

    @classmethod
    def plan(cls, velocity: Vectors, acceleration: Vectors, limits: LimitTable) -> Stop:
        """The stop from a motion."""
        ease = _norm(acceleration) / limits.jerk
        peak = peak_velocity(velocity, acceleration, limits)
        speed = _norm(peak)
        ramp = np.minimum(limits.acceleration / limits.jerk, np.sqrt(speed / limits.jerk))
        cruise = np.maximum(speed / limits.acceleration - ramp, 0.0)
        cruise = np.where(ramp * limits.jerk < limits.acceleration, 0.0, cruise)
        backwards = -_direction(peak) * limits.jerk
        jerks = np.stack(
            [
                -_direction(acceleration) * limits.jerk,
                backwards,
                np.zeros_like(backwards),
                -backwards,
            ]
        )
        return cls(velocity, acceleration, jerks, np.stack([ease, ramp, cruise, ramp]))

    @property
    def duration(self) -> float:
        """Until the last gripper rests [s]."""
        return float(np.max(np.sum(self.durations, axis=0), initial=0.0))

    def at(self, t: float | Float64[np.ndarray, "m 1 1 1"]) -> tuple[Vectors, Vectors, Vectors]:
        """Displacement, velocity and acceleration a time `t` [s] after the stop began."""
        left = np.asarray(t, dtype=float)
        displacement = np.zeros_like(self.velocity)
        velocity, acceleration = self.velocity, self.acceleration
        for jerk, duration in zip(self.jerks, self.durations, strict=True):
            tau = np.clip(left, 0.0, duration)
            left = left - duration
            displacement = displacement + tau * (
                velocity + tau * (acceleration / 2.0 + tau * jerk / 6.0)
            )
            velocity = velocity + tau * (acceleration + tau * jerk / 2.0)
            acceleration = acceleration + tau * jerk
        # Phases add up to rest but for rounding; rest is exact.
        over = left >= -1e-12
        return (
            displacement,
            np.where(over, 0.0, velocity),
            np.where(over, 0.0, acceleration),
        )
