"""Control of joint trajectories: one at a time, checked whole, and kept going by its sender."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float64

from lariat.safety.motion.follower import SetpointFollower
from lariat.safety.motion.joint_trajectory import JointPoints, check_trajectory
from lariat.safety.motion.validation import ChunkRefused
from lariat.scenario import SIDES, Side
from lariat.trajectory import NANOSECONDS
from services.robot_gateway.arms import Arms

State = Literal["", "executing", "reached", "cancelled", "refused", "stopped"]
ALIVE_AGE = 0.25
"""Age of the sender's last message at which the motion stops [s]."""
LATENESS = 1.0
"""Time after the end of the trajectory by which the arms must be there [s]."""


@dataclass(frozen=True)
class TrajectoryRequest:
    """Message of the sender: a trajectory, a sign of life, or a cancellation."""

    id: str
    """Id of the trajectory."""
    times: Float64[np.ndarray, "k"]
    """Times of the points [s]; none in a sign of life."""
    points: Mapping[Side, JointPoints]
    """Points of each arm."""
    cancel: bool = False
    """Whether to stop."""


class TrajectoryControl:
    """The trajectory of a cell."""

    def __init__(self, arms: Arms, follower: SetpointFollower) -> None:
        self._arms = arms
        self._follower = follower
        self.id = ""
        """Id of the trajectory that was handled last."""
        self.state: State = ""
        """State of it."""
        self.reason = ""
        """Why it was refused or stopped, in words."""
        self.planned = False
        """Whether this tick checked one, which takes long, while everything rested."""
        self._alive_at = self._end = 0

    @property
    def running(self) -> bool:
        """Whether one is executed."""
        return self.state == "executing"

    def note_alive(self, now: int) -> None:
        """Note at `now` [ns] that the sender wants it to go on."""
        self._alive_at = now

    def start(self, request: TrajectoryRequest, obstruction: str, now: int) -> None:
        """Follow a trajectory from `now` [ns] on, or refuse it where an obstruction is named."""
        self.id, self.state, self.reason = request.id, "refused", obstruction
        if obstruction:
            return
        drivers = [self._arms.drivers[k] for k in self._follower.driven]
        points = [request.points.get(SIDES[k]) for k in self._follower.driven]
        self.planned = True
        try:
            if sum(p is not None for p in points) < len(request.points):
                raise ChunkRefused("finite", "it names an end that does not move")
            joints = [driver.joint_constraints for driver in drivers]
            spline = check_trajectory(self._follower, joints, points, request.times, now)
        except ChunkRefused as refused:
            self.reason = str(refused)
            return
        self._follower.follow(spline, now)
        self.state, self._alive_at, self._end = "executing", now, spline.end

    def end(self, state: State, reason: str = "") -> None:
        """End it, if one is executed."""
        if self.running:
            self.state, self.reason = state, reason

    def silent(self, now: int) -> bool:
        """Return whether its sender is silent at `now` [ns]."""
        return (now - self._alive_at) * NANOSECONDS > ALIVE_AGE

    def late(self, now: int) -> bool:
        """Return whether it should have been reached before `now` [ns]."""
        return (now - self._end) * NANOSECONDS > LATENESS
