"""Driver of one's own: an arm whose joints follow with a lag, by its URDF."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.arms.description import CR5_URDF
from lariat.protocols import ArmFacts, ArmReading, ArmSetup

URDF = CR5_URDF
"""Description of your arm; here that of a Dobot CR5."""
TIME_CONSTANT = 0.05
"""Time constant with which the joints follow [s]."""


class LaggingArm:
    """Arm whose joints follow with a first-order lag; replace its state by your device's."""

    facts = ArmFacts(urdf=URDF, flange="link_6", simulated=True)

    def __init__(self, setup: ArmSetup) -> None:
        self.joints = setup.start.copy()
        self.powered, self.closed, self.time = False, True, 0.0

    def enable(self) -> None:
        """Switch the drives on, after a person has armed the cell."""
        self.powered = True

    def disable(self) -> None:
        """Take the power of the drives."""
        self.powered = False

    def set_gripper(self, close: bool) -> None:
        """Open or close the gripper."""
        self.closed = close

    def step(self, time: float, target: Float64[np.ndarray, "6"] | None) -> ArmReading:
        """Send one servo point and return what the arm reports."""
        share = 1.0 - np.exp(-(time - self.time) / TIME_CONSTANT) if self.time else 0.0
        self.time = time
        if self.powered and target is not None:
            self.joints += share * (target - self.joints)
        return ArmReading(self.joints.copy(), ready=self.powered, powered=self.powered)

    def close(self) -> None:
        """End the connection to the device."""
