"""Section of the limits of the grippers' motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from lariat.configuration import Bounds
from lariat.scenario.sections.quantities import Position
from lariat.trajectory import MotionLimits


@dataclass(frozen=True)
class Limits(MotionLimits):
    """Limits of the grippers' motion, which the gateway enforces."""

    speed: Annotated[float, Bounds(0.001, 2.0, "m/s")] = 0.5
    acceleration: Annotated[float, Bounds(0.01, 20.0, "m/s^2")] = 2.0
    jerk: Annotated[float, Bounds(0.1, 1000.0, "m/s^3")] = 40.0
    angular_speed: Annotated[float, Bounds(0.01, 6.0, "rad/s")] = 1.5
    angular_acceleration: Annotated[float, Bounds(0.1, 60.0, "rad/s^2")] = 6.0
    angular_jerk: Annotated[float, Bounds(1.0, 3000.0, "rad/s^3")] = 120.0
    joint_speed: Annotated[float, Bounds(0.01, 3.2, "rad/s")] = 1.6
    """Speed of every joint."""
    joint_acceleration: Annotated[float, Bounds(0.1, 30.0, "rad/s^2")] = 5.2
    """Acceleration of every joint."""
    workspace: tuple[Position, Position] = ((-0.8, -0.8, 0.01), (0.8, 0.8, 1.2))
    """Lowest and highest corner of the box in which the grips stay."""
    keep_out: Annotated[float, Bounds(0.0, 0.5, "m")] = 0.005
    """Least distance between a gripper's body and an obstacle."""
    gripper_radius: Annotated[float, Bounds(0.001, 0.2, "m")] = 0.012
    """Radius of the capsule that represents a gripper."""
    gripper_height: Annotated[float, Bounds(0.0, 0.5, "m")] = 0.06
    """Distance from the grip to the far end of that capsule."""
    spacing: Annotated[float, Bounds(0.0, 1.0, "m")] = 0.03
    """Least distance between the two grips."""
    overstretch: Annotated[float, Bounds(0.1, 1.0)] = 0.99
    """Largest distance between the grips around obstacles, in rope lengths."""
    pull: Annotated[float, Bounds(0.1, 200.0, "N")] = 20.0
    """Largest change of a gripper's contact force since arming."""
    tension: Annotated[float, Bounds(0.01, 1e5, "N")] | None = None
    """Largest tension of the rope, as the model has it; by default none is too large."""

    @property
    def gripper_reach(self) -> float:
        """Distance from the grip to the centre of that capsule's far cap [m]."""
        return max(self.gripper_height - self.gripper_radius, 0.0)

    def __post_init__(self) -> None:
        low, high = np.array(self.workspace)
        if np.any(low >= high):
            raise ValueError(
                f"workspace = {[list(c) for c in self.workspace]}; give the low corner first"
            )
