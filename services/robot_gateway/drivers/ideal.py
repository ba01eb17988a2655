"""Ends without a device: one that is exactly where it is commanded to be, and a fixed one."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from services.robot_gateway.constraints.joints import JointConstraints
from services.robot_gateway.drivers.driver import Feedback


class IdealDriver:
    """Follows without error; the cell keeps its command within the limits."""

    name = "ideal"
    moves = True
    live = False
    joint_constraints: JointConstraints | None = None
    tracking_limit = np.inf

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

    def grip(self, close: bool) -> None:
        self._closed = close

    def place(self, pose: Pose) -> bool:
        self._pose, self._velocity = pose, np.zeros((2, 3))
        return True

    def close(self) -> None:
        pass

    def step(self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]) -> Feedback:
        del now
        self._velocity = np.zeros((2, 3))
        if target is not None:
            self._pose, self._velocity = target, velocity
        return Feedback(self._pose, self._velocity, ready=True, gripper_closed=self._closed)


class FixedDriver(IdealDriver):
    """An end that is clamped to the world."""

    name = "fixed"
    moves = False

    def step(self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]) -> Feedback:
        return super().step(now, None, velocity)
