"""What the cell expects of an arm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from services.robot_gateway.constraints.joints import JointConstraints


@dataclass(frozen=True)
class Feedback:
    """What an arm says of itself at one tick."""

    pose: Pose | None
    """Of the grip in the world, measured; None while unknown."""
    velocity: Float64[np.ndarray, "2 3"]
    """Linear and angular in the world [m/s, rad/s]."""
    ready: bool
    """Enabled and able to follow."""
    fault: str = ""
    """A row of `STOP_CAUSES`, `alarm` or `lost_link`, or empty."""
    alarms: tuple[str, ...] = ()
    """In words."""
    joints: tuple[float, ...] = ()
    """[rad]"""
    gripper_closed: bool = True
    age: float = 0.0
    """Since the device last spoke [s]."""
    mode: str = ""
    """What the device says that it does, in words."""
    link_rate: float = 0.0
    """Times that it was heard within the last second [Hz]."""
    link_gap: float = 0.0
    """Longest time between two of these [s]."""
    pull: float = 0.0
    """Change of the force at the gripper since it was armed at rest [N]; 0 when it feels none."""


class Driver(Protocol):
    """One arm."""

    name: str
    """As in the scenario: fixed, ideal or cr5."""
    moves: bool
    """False for an end that is fixed to the world."""
    joint_constraints: JointConstraints | None
    """Rules of its joints, when it has any."""
    live: bool
    """Whether a device is at the other end of a wire, which time alone does not advance."""
    tracking_limit: float
    """Distance between command and feedback that is a fault [m]."""

    def enable(self) -> None:
        """Brings the arm to where it can follow, over the next ticks; a person has armed."""
        ...

    def disable(self) -> None:
        """Takes the power away; the arm is at rest."""
        ...

    def recover(self) -> None:
        """Clears what stopped it, over the next ticks; a person has acknowledged."""
        ...

    def grip(self, close: bool) -> None:
        """Opens or closes the gripper."""
        ...

    def place(self, pose: Pose) -> bool:
        """Begins to put the grip somewhere; simulation only. False when it cannot.

        Until it is there the feedback says that it is not ready.
        """
        ...

    def close(self) -> None:
        """Ends the connection in an orderly way; the arm is disabled."""
        ...

    def step(self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]) -> Feedback:
        """One tick.

        Args:
            now: [ns].
            target: Where the grip shall be now; None when nothing may move.
            velocity: Of the target [m/s, rad/s].
        """
        ...
