"""Drivers of ends without a device: an ideal arm without tracking error, and a clamp."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.safety.constraints.joints import JointConstraints
from services.robot_gateway.drivers.driver import ArmFeedback


class IdealDriver:
    """Arm that is exactly where it is commanded to be."""

    name = "ideal"
    moves = True
    reaches_hardware = False
    live = False
    joint_constraints: JointConstraints | None = None
    tracking_limit = np.inf
    tracking_angle_limit = np.inf

    def __init__(self, start: Pose) -> None:
        self._pose = start
        self._velocity = np.zeros((2, 3))
        self._closed = True

    def enable(self) -> None:
        pass

    def disable(self) -> None:
        pass

    def recover(self) -> None:
        pass

    def set_gripper(self, close: bool) -> None:
        self._closed = close

    def place(self, pose: Pose) -> bool:
        self._pose, self._velocity = pose, np.zeros((2, 3))
        return True

    def close(self) -> None:
        pass

    def step(
        self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]
    ) -> ArmFeedback:
        del now
        self._velocity = np.zeros((2, 3))
        if target is not None:
            self._pose, self._velocity = target, velocity
        return ArmFeedback(self._pose, self._velocity, ready=True, gripper_closed=self._closed)


class FixedDriver(IdealDriver):
    """Driver of a clamp, which ignores its commands."""

    name = "fixed"
    moves = False

    def step(
        self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]
    ) -> ArmFeedback:
        return super().step(now, None, velocity)
