"""How fast a gripper may move, and the names of the rules that stop it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float64

Rule = Literal[
    "finite",
    "ordered",
    "fresh",
    "rest",
    "workspace",
    "keep_out",
    "table",
    "joint_limits",
    "joint_speed",
    "singularity",
    "speed",
    "acceleration",
    "jerk",
    "step",
    "spacing",
    "overstretch",
    "lost_link",
]
"""Names used in refusals, logs, `docs/safety.md` and tests."""


@dataclass(frozen=True)
class MotionLimits:
    """Bounds on the commanded motion of one gripper; each is on the norm of a vector."""

    speed: float = 0.5
    """[m/s]"""
    acceleration: float = 2.0
    """[m/s^2]"""
    jerk: float = 40.0
    """[m/s^3]"""
    angular_speed: float = 1.5
    """[rad/s]"""
    angular_acceleration: float = 6.0
    """[rad/s^2]"""
    angular_jerk: float = 120.0
    """[rad/s^3]"""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"limits.{name} must be positive and finite, got {value}")


@dataclass(frozen=True)
class LimitTable:
    """Limits of n grippers as arrays that broadcast with motions of shape "n 2 3".

    Row 0 of the middle axis is translation, row 1 rotation.
    """

    speed: Float64[np.ndarray, "n 2 1"]
    """[m/s], [rad/s]"""
    acceleration: Float64[np.ndarray, "n 2 1"]
    """[m/s^2], [rad/s^2]"""
    jerk: Float64[np.ndarray, "n 2 1"]
    """[m/s^3], [rad/s^3]"""

    @classmethod
    def of(cls, limits: list[MotionLimits]) -> LimitTable:
        """One row for every gripper."""

        def column(linear: str, angular: str) -> Float64[np.ndarray, "n 2 1"]:
            rows = [(getattr(limit, linear), getattr(limit, angular)) for limit in limits]
            return np.array(rows, dtype=float).reshape(-1, 2, 1)

        return cls(
            column("speed", "angular_speed"),
            column("acceleration", "angular_acceleration"),
            column("jerk", "angular_jerk"),
        )
