"""Protocol of an arm: wanted joint angles in, measured joint angles out.

Everything else is Lariat's: the kinematics from the URDF, the rules of the gateway, the way from
poses of the grip to joint angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Float64

Joints = Float64[np.ndarray, "j"]
"""Joint angles from the root of the URDF to the flange [rad]."""


@dataclass(frozen=True)
class ArmFacts:
    """Facts of an arm that its class states: `facts = ArmFacts(…)`."""

    urdf: Path | None = None
    """Description of the arm; by default that of the scenario, `ends.*.urdf`."""
    flange: str = ""
    """Link of the URDF that carries the tool; by default that of the scenario, `ends.*.flange`."""
    simulated: bool = False
    """Whether the arm is a simulation in this process, which needs no address."""
    rate: float = 125.0
    """Rate at which `step` is called, at most that of the gateway, 125 Hz [Hz]."""
    tracking_limit: float = 0.02
    """Distance of the grip from its path above which the arm is at fault [m]; an arm may follow
    its path up to 0.25 s late."""
    force_sensing: bool = False
    """Whether the arm measures the force at its flange."""


@dataclass(frozen=True)
class ArmSetup:
    """Facts that hold for the life of an arm."""

    side: str
    """End of the rope that it holds: left or right."""
    address: str
    """Address of the device; empty for a simulation."""
    urdf: Path
    """Description of the arm."""
    flange: str
    """Link of the URDF that carries the tool."""
    start: Joints
    """Joint angles at the scenario's start [rad]."""
    joint_speed: float
    """Limit on the speed of every joint [rad/s]."""


@dataclass(frozen=True)
class ArmReading:
    """State that an arm reports."""

    joints: Joints | None
    """Measured joint angles; None while they are not known [rad]."""
    velocities: Joints | None = None
    """Measured joint velocities; by default differences of the angles [rad/s]."""
    ready: bool = False
    """Whether the arm would follow now."""
    powered: bool = True
    """Whether its drives may be on: the device does not report that they are off."""
    connected: bool = True
    """Whether the device answers."""
    faults: tuple[str, ...] = ()
    """Reasons why it has stopped by itself, in words for a person."""
    gripper_closed: bool = True
    """Whether the gripper is closed."""
    force: Float64[np.ndarray, "3"] | None = None
    """Force on the flange, in the axes of the URDF's root [N]; None without a sensor."""
    mode: str = ""
    """Operating mode in words."""


class Arm(Protocol):
    """Arm that follows joint angles. No method may wait: whatever blocks belongs in a thread."""

    facts: ArmFacts

    def __init__(self, setup: ArmSetup) -> None:
        """Create the arm; the device is not touched before `step`."""
        ...

    def enable(self) -> None:
        """Begin to make the arm ready, after a person has armed it or acknowledged a fault."""
        ...

    def disable(self) -> None:
        """Begin to stop the arm and to take its power; called until the reading has it off."""
        ...

    def set_gripper(self, close: bool) -> None:
        """Begin to open or close the gripper."""
        ...

    def step(self, time: float, target: Joints | None) -> ArmReading:
        """Exchange one servo point and the state.

        Args:
            time: Present time [s].
            target: Wanted joint angles [rad]; None when the arm must not move.
        """
        ...

    def close(self) -> None:
        """End the connection to a disabled arm."""
        ...
