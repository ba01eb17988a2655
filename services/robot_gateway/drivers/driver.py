"""Protocol of an arm driver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.safety.constraints.joints import JointConstraints


@dataclass(frozen=True)
class ArmFeedback:
    """State that an arm reports at one tick."""

    pose: Pose | None
    """Measured pose of the grip in the world; None while unknown."""
    velocity: Float64[np.ndarray, "2 3"]
    """Linear and angular velocity of the grip in the world [m/s, rad/s]."""
    ready: bool
    """Whether the arm is enabled and can follow."""
    fault: str = ""
    """Stop cause: `alarm`, `lost_link` or empty."""
    alarms: tuple[str, ...] = ()
    """Alarms in words."""
    joints: tuple[float, ...] = ()
    """Joint angles [rad]."""
    gripper_closed: bool = True
    """Commanded state of the gripper."""
    age: float = 0.0
    """Time since the last packet of the arm [s]."""
    mode: str = ""
    """Operating mode in words."""
    link_rate: float = 0.0
    """Packets within the last second [Hz]."""
    link_gap: float = 0.0
    """Longest time between two packets within the last second [s]."""
    contact_force: float = 0.0
    """Change of the force at the gripper since it was armed at rest [N]; 0 without a sensor."""
    wrench: Float64[np.ndarray, "2 3"] | None = None
    """Force and torque on the gripper that the device states, about the grip in the world [N, N m];
    None without a sensor, and a torque of NaN where it states none."""
    powered: bool = False
    """Whether its drives may be on: the device does not report that they are off."""


class Driver(Protocol):
    """One end of the rope: an arm, or a fixed clamp."""

    name: str
    """Name in a scenario."""
    moves: bool
    """Whether the end moves; a clamp does not."""
    joint_constraints: JointConstraints | None
    """Constraints of its joints; None without joints."""
    reaches_hardware: bool
    """Whether it can reach hardware; a simulation and Lariat's own emulator are none."""
    live: bool
    """Whether the arm runs on its own clock, not on that of `step`."""
    tracking_limit: float
    """Distance between command and feedback above which the arm is at fault [m]."""
    tracking_angle_limit: float
    """Angle between command and feedback above which the arm is at fault [rad]."""

    def enable(self) -> None:
        """Begin to make the arm ready, after a person has armed it; takes several ticks."""
        ...

    def disable(self) -> None:
        """Begin to stop the arm and to take its power, whoever gave it; takes several ticks.

        Called again and again until the feedback reports that the drives are off.
        """
        ...

    def recover(self) -> None:
        """Begin to clear a fault, after a person has acknowledged it; takes several ticks."""
        ...

    def set_gripper(self, close: bool) -> None:
        """Open or close the gripper."""
        ...

    def place(self, pose: Pose) -> bool:
        """Begin to put the grip at a pose; simulation only. Return False when that is impossible.

        The feedback is not ready until the grip is there.
        """
        ...

    def close(self) -> None:
        """Close the connection to a disabled arm in an orderly way."""
        ...

    def step(
        self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]
    ) -> ArmFeedback:
        """Exchange command and feedback for one tick.

        Args:
            now: Time [ns].
            target: Commanded grip pose; None when the arm must not move.
            velocity: Linear and angular velocity of the target [m/s, rad/s].
        """
        ...
