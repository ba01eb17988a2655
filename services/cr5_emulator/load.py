"""What pulls at the emulated arm's gripper: an elastic line to a point of the base's frame.

It stands for a rope that is held at its other end: slack while it is longer than the way, a spring
beyond. The arm tells the force as a real one does that infers it from its motors' currents: at the
gripper, along the base's axes, with noise when asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from services.cr5_emulator.geometry import Transform

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Tether:
    """The line."""

    anchor: Vector
    """Its far end in the base [m]."""
    length: float
    """Without load [m]."""
    stiffness: float
    """[N/m]"""
    grip: Vector = (0.0, 0.0, 0.0)
    """Its near end in the flange's frame [m]."""

    @classmethod
    def of(cls, numbers: tuple[float, ...]) -> Tether | None:
        """From anchor, length, stiffness and grip in a row; None from nothing.

        Raises:
            ValueError: Another count of numbers.
        """
        if not numbers:
            return None
        if len(numbers) not in (5, 8):
            raise ValueError(
                "tether takes x y z of its far end, length, stiffness and, if it likes, x y z of "
                f"the grip; got {len(numbers)} numbers"
            )
        x, y, z, length, stiffness, *grip = numbers
        a, b, c = grip or (0.0, 0.0, 0.0)
        return cls((x, y, z), length, stiffness, (a, b, c))

    def force(self, flange: Transform) -> Float64[np.ndarray, "3"]:
        """On the gripper, in the base [N]."""
        at = flange[:3, :3] @ np.array(self.grip) + flange[:3, 3]
        way = np.array(self.anchor) - at
        distance = float(np.linalg.norm(way))
        stretched = max(distance - self.length, 0.0)
        return self.stiffness * stretched * way / max(distance, 1e-12)
