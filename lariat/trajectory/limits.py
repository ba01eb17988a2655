"""Limits on the motion of a gripper."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64

Bounds = Float64[np.ndarray, "2 1"]
"""A bound on translation (row 0) and one on rotation (row 1)."""


@dataclass(frozen=True)
class MotionLimits:
    """Limits on speed, acceleration and jerk of a gripper; each bounds the norm of a vector.

    Raises:
        ValueError: A limit is not positive.
    """

    speed: float
    """Speed [m/s]."""
    acceleration: float
    """Acceleration [m/s^2]."""
    jerk: float
    """Jerk [m/s^3]."""
    angular_speed: float
    """Angular speed [rad/s]."""
    angular_acceleration: float
    """Angular acceleration [rad/s^2]."""
    angular_jerk: float
    """Angular jerk [rad/s^3]."""

    def __post_init__(self) -> None:
        for name in MotionLimits.__dataclass_fields__:
            value = getattr(self, name)
            if not value > 0.0:
                raise ValueError(f"limits.{name} must be positive, got {value}")

    def scaled(self, fraction: float) -> MotionLimits:
        """Return a fraction of each limit.

        Args:
            fraction: Factor on every limit, positive.
        """
        return MotionLimits(
            *(fraction * getattr(self, name) for name in MotionLimits.__dataclass_fields__)
        )

    @cached_property
    def speed_bounds(self) -> Bounds:
        """Limits on speed, which broadcast with vectors of shape "k 2 3" [m/s, rad/s]."""
        return np.array([[self.speed], [self.angular_speed]])

    @cached_property
    def acceleration_bounds(self) -> Bounds:
        """Limits on acceleration [m/s^2, rad/s^2]."""
        return np.array([[self.acceleration], [self.angular_acceleration]])

    @cached_property
    def jerk_bounds(self) -> Bounds:
        """Limits on jerk [m/s^3, rad/s^3]."""
        return np.array([[self.jerk], [self.angular_jerk]])


def norms(vectors: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b 1"]:
    """Return the Euclidean norms of vectors, with the last axis kept."""
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))[..., None]


def clipped(vectors: Float64[np.ndarray, "*b 2 3"], bound: Bounds) -> Float64[np.ndarray, "*b 2 3"]:
    """Return vectors shortened to a bound on their norm, in their own direction."""
    return vectors * np.minimum(1.0, bound / np.maximum(norms(vectors), 1e-300))
