"""Elastic tether between the emulated gripper and a fixed point in the base frame.

It stands for a rope that is held at its other end: slack below its rest length, a linear spring
above. The arm reports the force as a real one infers it from its motor currents: at the gripper, in
the axes of the base, with optional noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from services.cr5_emulator.kinematics import Transform

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Tether:
    """Unilateral spring."""

    anchor: Point
    """Fixed end in the base [m]."""
    length: float
    """Rest length [m]."""
    stiffness: float
    """Stiffness [N/m]."""
    grip: Point = (0.0, 0.0, 0.0)
    """End at the gripper, in the flange frame [m]."""

    @classmethod
    def of(cls, numbers: tuple[float, ...]) -> Tether | None:
        """Create a tether from anchor, length, stiffness and grip; None from an empty tuple."""
        if not numbers:
            return None
        if len(numbers) not in (5, 8):
            raise ValueError(
                "tether takes x y z of its fixed end, length, stiffness and optionally x y z of "
                f"the grip; got {len(numbers)} numbers"
            )
        x, y, z, length, stiffness, *grip = numbers
        a, b, c = grip or (0.0, 0.0, 0.0)
        return cls((x, y, z), length, stiffness, (a, b, c))

    def wrench(
        self, flange: Transform, tip: Float64[np.ndarray, "3"]
    ) -> Float64[np.ndarray, "2 3"]:
        """Return force and torque on the gripper about a point, in the base [N, N m]."""
        grip = flange[:3, :3] @ np.array(self.grip) + flange[:3, 3]
        to_anchor = np.array(self.anchor) - grip
        distance = float(np.linalg.norm(to_anchor))
        extension = max(distance - self.length, 0.0)
        force = self.stiffness * extension * to_anchor / max(distance, 1e-12)
        return np.array([force, np.cross(grip - tip, force)])
