"""Action `follow_joint_trajectory`: a trajectory that the gateway checks, executes and may stop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from typing import Any

import numpy as np

from lariat.scenario import Side
from lariat.trajectory import NANOSECONDS, SECOND
from shared import topics
from shared.messages import ArmStates, JointPath, JointTrajectory
from shared.messages.checks.arms import MAX_TRAJECTORY_POINTS
from shared.ros2.actions import ActionServer, ServerGoal, Status
from shared.ros2.node import Node
from shared.ros2.types import FOLLOW_TRAJECTORY, duration, header, nanoseconds, ros
from shared.runtime.service import Inbox, Publication

ANSWER_TIMEOUT = SECOND
"""Longest wait for the gateway's answer [ns]."""
MAX_STAMP_AGE = 0.5
"""Age of the stamp of a trajectory, which begins when it comes, above which it is old [s]."""
SETTLE_TIME = 1.0, 10.0
"""Wait for the tolerances of a goal that states none, and the longest one [s]."""


class Code(IntEnum):
    """Error codes of FollowJointTrajectory."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class GoalRefused(ValueError):
    """Goal that the gateway is not asked to execute."""

    def __init__(self, code: Code, reason: str) -> None:
        super().__init__(reason)
        self.code = code


@dataclass
class Execution:
    """Goal that is executed."""

    goal: ServerGoal
    request: JointTrajectory
    names: list[str]
    """Joints in the order of the request."""
    path_tolerance: dict[str, float]
    """Largest error of the joints on their way [rad]."""
    goal_tolerance: dict[str, float]
    """The same at the end."""
    settle_time: float
    """Time for that [s]."""
    sent: int
    """Time of its first sending [ns]."""
    reached: int | None = None
    """Time at which the command was at the end [ns]."""
    violation: str = ""
    """Tolerance of the path that was violated, in words."""


class ArmAction:
    """Server that executes one goal at a time, and refuses others meanwhile."""

    def __init__(
        self, node: Node, session: str, name: str, joints: Mapping[Side, list[str]]
    ) -> None:
        """Serve the action. Args: joints: Names of the joints of each arm that has some."""
        self._server = ActionServer(node, name, FOLLOW_TRAJECTORY)
        self._door = node.door
        self._session, self._count = session, 0
        self._joints = dict(joints)
        self._execution: Execution | None = None

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Take goals, and yield what the gateway is told of the one that is executed."""
        for goal in self._server.take():
            # A rejection carries no code and no words: a refused goal is accepted and aborted.
            goal.accept()
            code = Code.INVALID_GOAL
            with self._door.guard("ROS 2 follow_joint_trajectory") as outcome:
                try:
                    self._begin(goal, now)
                except GoalRefused as refused:
                    code = refused.code
                    raise
            if outcome.refusal:
                self._end(goal, Status.ABORTED, code, outcome.refusal)
        newest = inbox.latest(topics.ARM_STATE)
        if self._execution is not None and newest is not None:
            self._follow(self._execution, newest.message, now)
        execution = self._execution
        if execution is None:
            return
        request = JointTrajectory(id=execution.request.id, stamp=now)
        if newest is None or newest.message.trajectory != request.id:
            if now - execution.sent > ANSWER_TIMEOUT:
                words = "the gateway has not answered; lariat status shows whether it runs"
                self._end(execution.goal, Status.ABORTED, Code.INVALID_GOAL, words)
                request.cancel = True
            else:
                # Sent until it is answered; the gateway counts its id once.
                request = execution.request
        else:
            self._report(execution, newest.message, now)
            request.cancel = execution.goal.cancel_requested or bool(execution.violation)
        yield Publication(topics.ARM_TRAJECTORY, request)

    def _begin(self, goal: ServerGoal, now: int) -> None:
        if self._execution is not None:
            raise GoalRefused(Code.INVALID_GOAL, "another goal is executed; cancel it first")
        message, names = goal.message, list(goal.message.trajectory.joint_names)
        sides = [s for s, joints in self._joints.items() if not set(names).isdisjoint(joints)]
        whole = [name for side in sides for name in self._joints[side]]
        if not names or sorted(names) != sorted(whole):
            arms = "; ".join(", ".join(joints) for joints in self._joints.values()) or "none"
            raise GoalRefused(Code.INVALID_JOINTS, f"name all joints of an arm or of both: {arms}")
        if message.multi_dof_trajectory.points:
            raise GoalRefused(Code.INVALID_GOAL, "a trajectory of several degrees has no joints")
        times, positions, velocities = _points(message.trajectory)
        age = (now - (nanoseconds(message.trajectory.header.stamp) or now)) * NANOSECONDS
        if abs(age) > MAX_STAMP_AGE:
            code = Code.OLD_HEADER_TIMESTAMP if age > 0.0 else Code.INVALID_GOAL
            raise GoalRefused(code, f"its stamp is {age:.1f} s old; it begins at once: stamp 0")
        path, end = (
            _tolerances(each, names) for each in (message.path_tolerance, message.goal_tolerance)
        )
        if message.component_path_tolerance or message.component_goal_tolerance:
            raise GoalRefused(Code.INVALID_GOAL, "tolerances of components are not judged")
        arms = []
        for side in sides:
            order = [names.index(name) for name in self._joints[side]]
            speeds = [] if velocities is None else velocities[:, order].ravel()
            arms.append(
                JointPath(arm=side, positions=positions[:, order].ravel(), velocities=speeds)
            )
        self._count += 1
        id = f"{self._session}-trajectory-{self._count}"
        request = JointTrajectory(id=id, stamp=now, times=times, arms=arms)
        settle = nanoseconds(message.goal_time_tolerance) * NANOSECONDS or SETTLE_TIME[0]
        settle = min(settle, SETTLE_TIME[1])
        self._execution = Execution(goal, request, whole, path, end, settle, now)

    def _follow(self, execution: Execution, state: ArmStates, now: int) -> None:
        """Judge a state of the arms."""
        if state.trajectory != execution.request.id:
            return
        goal, words = execution.goal, state.trajectory_reason
        match state.trajectory_state:
            case ArmStates.EXECUTING:
                errors = _joints(execution, state, "commanded_joints")
                errors -= _joints(execution, state, "joints")
                late = _violated(execution, errors, execution.path_tolerance)
                execution.violation = execution.violation or late
            case ArmStates.REFUSED:
                self._end(goal, Status.ABORTED, Code.INVALID_GOAL, words)
            case ArmStates.CANCELLED if execution.violation:
                code = Code.PATH_TOLERANCE_VIOLATED
                self._end(goal, Status.ABORTED, code, execution.violation)
            case ArmStates.CANCELLED:
                self._end(goal, Status.CANCELED, Code.SUCCESSFUL, "cancelled")
            case ArmStates.REACHED:
                execution.reached = execution.reached or now
                arms, count = execution.request.arms, len(execution.request.times)
                ends = [v for path in arms for v in path.positions[-len(path.positions) // count :]]
                # Angles that are not known are not at the goal.
                errors = np.nan_to_num(_joints(execution, state, "joints") - ends, nan=np.inf)
                left = _violated(execution, errors, execution.goal_tolerance)
                if goal.cancel_requested and left:
                    self._end(goal, Status.CANCELED, Code.SUCCESSFUL, "cancelled")
                elif not left:
                    self._end(goal, Status.SUCCEEDED, Code.SUCCESSFUL, "")
                elif (now - execution.reached) * NANOSECONDS > execution.settle_time:
                    self._end(goal, Status.ABORTED, Code.GOAL_TOLERANCE_VIOLATED, left)
            case _:
                words = words or "the gateway stopped it"
                self._end(goal, Status.ABORTED, Code.INVALID_GOAL, words)

    def _report(self, execution: Execution, state: ArmStates, now: int) -> None:
        commanded = _joints(execution, state, "commanded_joints")
        measured = _joints(execution, state, "joints")
        if np.isnan(commanded - measured).any():
            return
        since = duration(max(now - execution.sent, 0))
        point = "trajectory_msgs/msg/JointTrajectoryPoint"
        desired, actual, error = (
            ros(point, positions=positions, time_from_start=since)
            for positions in (commanded, measured, commanded - measured)
        )
        execution.goal.feedback(
            header=header(now, ""),
            joint_names=execution.names,
            desired=desired,
            actual=actual,
            error=error,
        )

    def _end(self, goal: ServerGoal, status: Status, code: Code, words: str) -> None:
        goal.end(status, error_code=int(code), error_string=words)
        if self._execution is not None and self._execution.goal is goal:
            self._execution = None


def _points(trajectory: Any) -> tuple[list[int], np.ndarray, np.ndarray | None]:
    """Times [ns], positions and velocities of a trajectory."""
    points, count = trajectory.points, len(trajectory.joint_names)
    if not 0 < len(points) <= MAX_TRAJECTORY_POINTS:
        words = f"{len(points)} points; a trajectory has 1 to {MAX_TRAJECTORY_POINTS}"
        raise GoalRefused(Code.INVALID_GOAL, words)
    times = [nanoseconds(point.time_from_start) for point in points]
    if any(b <= a for a, b in pairwise([-1, *times])):
        raise GoalRefused(Code.INVALID_GOAL, "time_from_start does not increase")
    if any(len(point.positions) != count for point in points):
        raise GoalRefused(Code.INVALID_GOAL, "a point has not one position for each joint")
    lengths = {len(point.velocities) for point in points}
    if lengths not in ({0}, {count}):
        raise GoalRefused(Code.INVALID_GOAL, "velocities are those of all joints at all points")
    positions = np.array([point.positions for point in points])
    velocities = np.array([point.velocities for point in points]) if lengths == {count} else None
    for rows in (positions, velocities):
        if rows is not None and not np.all(np.abs(rows) <= 1e3):
            raise GoalRefused(Code.INVALID_GOAL, "a number of it is not finite, or beyond 1000")
    return times, positions, velocities


def _tolerances(messages: Any, names: list[str]) -> dict[str, float]:
    """Tolerances of positions by joint; those of 0 and below are none."""
    tolerances = {}
    for message in messages:
        if message.name not in names:
            raise GoalRefused(Code.INVALID_JOINTS, f"a tolerance names the joint {message.name!r}")
        if message.velocity > 0.0 or message.acceleration > 0.0:
            words = "tolerances of velocity and acceleration are not judged; give those of position"
            raise GoalRefused(Code.INVALID_GOAL, words)
        if message.position > 0.0:
            tolerances[message.name] = float(message.position)
    return tolerances


def _joints(execution: Execution, state: ArmStates, field: str) -> np.ndarray:
    """Angles of the executed arms; NaN where one is not known."""
    arms = {arm.arm: arm for arm in state.arms}
    row = [value for path in execution.request.arms for value in getattr(arms[path.arm], field)]
    count = len(execution.names)
    return np.array(row) if len(row) == count else np.full(count, np.nan)


def _violated(execution: Execution, errors: np.ndarray, tolerances: dict[str, float]) -> str:
    """First tolerance that an error exceeds, in words."""
    for name, error in zip(execution.names, np.abs(errors), strict=True):
        if name in tolerances and error > tolerances[name]:
            return f"{name} is {error:.4f} rad off, more than {tolerances[name]:g} rad"
    return ""
