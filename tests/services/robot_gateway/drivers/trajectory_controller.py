"""Stand-in of ros2_control: a joint trajectory controller with lag, and its joint states.

    python -m tests.services.robot_gateway.drivers.trajectory_controller ROUTER NAMES START

NAMES and START are joined by commas. It serves the router.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from services.robot_gateway.drivers.ros2 import TRAJECTORY
from shared.ros2.actions import ActionServer, ServerGoal, Status
from shared.ros2.node import Node
from shared.ros2.types import FOLLOW_TRAJECTORY, header, nanoseconds, ros

CONTROLLER = "joint_trajectory_controller"
RATE = 200.0
LAG = 0.02
"""Time constant of the drives [s]."""


class TrajectoryController:
    """Arm whose drives follow the points of trajectories, interpolated from the last command."""

    def __init__(
        self,
        router: str,
        names: list[str],
        start: np.ndarray,
        action: bool = False,
        controller: str = CONTROLLER,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """With `action`, it has no topic, but serves goals; each replaces the one before."""
        self.node = Node(f"{controller}_manager", router=router)
        self._clock = clock
        self.server = self._commands = None
        if action:
            name = f"/{controller}/follow_joint_trajectory"
            self.server = ActionServer(self.node, name, FOLLOW_TRAJECTORY)
        else:
            self._commands = self.node.subscription(f"/{controller}/joint_trajectory", TRAJECTORY)
        self.rejects, self.gives_up = False, ""
        self._goal: ServerGoal | None = None
        self._states = self.node.publisher("/joint_states", "sensor_msgs/msg/JointState")
        self._names, self.joints = names, np.array(start, float)
        self._from, self._to = self.joints.copy(), self.joints.copy()
        self._begun, self._duration = 0.0, 0.0
        self._time = self._clock()
        self.points = 0
        self.deaf = False

    def unsubscribe(self) -> None:
        """Hears no commands any more, as a controller that has been stopped."""
        self.deaf = True
        assert self._commands is not None
        self._commands._subscriber.undeclare()

    def step(self) -> None:
        """Advances to the present time."""
        now = self._clock()
        elapsed, self._time = now - self._time, now
        for message in () if self.deaf else self._taken():
            self._from, self._begun = self._command(now), now
            order = [message.joint_names.index(name) for name in self._names]
            self._to = np.asarray(message.points[-1].positions)[order]
            self._duration = 1e-9 * nanoseconds(message.points[-1].time_from_start)
            self.points += 1
        before = self.joints
        self.joints = before + (self._command(now) - before) * (1.0 - np.exp(-elapsed / LAG))
        # Other joints of the robot come first, in another order.
        self._states.put(self._state((self.joints - before) / max(elapsed, 1e-6)))

    def end_goal(self, status: Status, code: int = 0, words: str = "") -> None:
        """Ends the goal that is executed."""
        if self._goal is not None:
            self._goal.end(status, error_code=code, error_string=words)
            self._goal = None

    def _taken(self) -> Iterator[Any]:
        if self._commands is not None:
            yield from self._commands.take()
            return
        assert self.server is not None
        for goal in self.server.take():
            if self.rejects:
                goal.reject()
                continue
            self.end_goal(Status.ABORTED, words="replaced")
            goal.accept()
            self._goal = goal
            if self.gives_up:
                self.end_goal(Status.ABORTED, -4, self.gives_up)
                continue
            yield goal.message.trajectory
        if self._goal and self._clock() - self._begun > self._duration:
            self.end_goal(Status.SUCCEEDED)

    def run(self) -> None:
        while True:
            self.step()
            time.sleep(1.0 / RATE)

    def _command(self, now: float) -> np.ndarray:
        if self._duration <= 0.0:
            return self._to
        return self._from + min(1.0, (now - self._begun) / self._duration) * (self._to - self._from)

    def _state(self, velocities: np.ndarray) -> Any:
        return ros(
            "sensor_msgs/msg/JointState",
            header=header(time.time_ns(), ""),
            name=["gripper", *reversed(self._names)],
            position=np.array([0.0, *reversed(self.joints)]),
            velocity=np.array([0.0, *reversed(velocities)]),
        )


if __name__ == "__main__":
    address, joint_names, angles = sys.argv[1:]
    TrajectoryController(address, joint_names.split(","), np.array(angles.split(","), float)).run()
