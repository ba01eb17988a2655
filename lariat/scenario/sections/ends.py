"""Sections of the arms at both ends of the rope."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from lariat.configuration import Bounds, Extensible
from lariat.scenario.sections.quantities import Position, Quaternion, Vector

DRIVERS = Extensible(("fixed", "ideal", "cr5", "simulated", "ur", "ros2"), "lariat.drivers")
"""Arm drivers; those from outside are a `lariat.protocols.Arm`."""
OWN_PROTOCOL_DRIVERS = ("fixed", "ideal", "cr5")
"""Drivers whose arms are not described by `ends.*.urdf`."""
HARMLESS_DRIVERS = ("fixed", "ideal", "simulated")
"""Drivers that can never reach hardware."""


@dataclass(frozen=True)
class End:
    """Arm that holds one end of the rope."""

    driver: Annotated[str, DRIVERS] = "ideal"
    """Arm: none, one that follows exactly, a Dobot CR5, that of `urdf` in MuJoCo, one of Universal
    Robots, one behind a ROS 2 trajectory controller, or an own class."""
    rotates: bool = False
    """Whether the gripper may change its orientation."""
    arm_automatically: bool = True
    """Whether the gateway arms this end by itself; never with an `address`."""
    address: str = ""
    """Address of a real arm; without, it is emulated or simulated."""
    urdf: str = ""
    """URDF of an arm that brings none, beside the scenario or absolute."""
    flange: str = ""
    """Link of that URDF that carries the tool."""
    firmware: Literal["v3", "v4"] = "v3"
    """Firmware of the emulated arm; that of a real arm is detected."""
    grip_length: Annotated[float, Bounds(0.0, 0.5, "m")] = 0.0
    """Length of the rope in the gripper's pads; the grip is where the rope leaves them."""
    base_position: Position = (0.0, 0.0, 0.0)
    """Position of the arm's base, the root of its URDF, in the world."""
    base_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Orientation of the arm's base in the world."""
    tool_position: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.0, 0.12)
    """Position of the grip in the flange's frame."""
    tool_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Orientation of the grip in the flange's frame."""
    tool_output: Annotated[int, Bounds(1, 2)] = 1
    """Digital output at the flange that closes the gripper."""
    load: Annotated[float, Bounds(0.0, 5.0, "kg")] = 0.0
    """Mass of the gripper and what it holds; if wrong, a CR5 reports a collision."""
    load_center: Annotated[Vector, Bounds(-0.5, 0.5, "m")] = (0.0, 0.0, 0.0)
    """Centre of that mass in the flange's frame."""
    collision_level: Annotated[int, Bounds(0, 5)] = 3
    """Sensitivity of a CR5's collision detection; 0 is off."""
    calibrated: bool = False
    """Whether the emulated arm differs from the nominal one, as a real arm does."""

    @property
    def reaches_hardware(self) -> bool:
        """Whether the driver can reach hardware.

        Every driver with an address can, whatever the address. Without one, the launcher's own
        emulator stands in for a CR5, and `simulated` for any other arm.
        """
        return bool(self.address) and self.driver not in HARMLESS_DRIVERS

    def __post_init__(self) -> None:
        if self.driver == "fixed" and self.rotates:
            raise ValueError("rotates = true needs a driver that moves, got driver = 'fixed'")
        if self.address and self.driver in HARMLESS_DRIVERS:
            raise ValueError(
                f"address = {self.address!r} needs the driver of an arm, not {self.driver!r}"
            )
        if self.driver in ("simulated", "ur", "ros2") and not (self.urdf and self.flange):
            raise ValueError(f"driver = {self.driver!r} needs urdf and flange")
        if self.urdf and self.driver in OWN_PROTOCOL_DRIVERS:
            raise ValueError(f"urdf = {self.urdf!r} has no meaning for driver = {self.driver!r}")


@dataclass(frozen=True)
class Ends:
    """Arms at both ends of the rope."""

    left: End = End()
    right: End = End()
