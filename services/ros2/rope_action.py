"""Action `shape_rope`: a goal, feedback on the way, and the result of the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lariat.trajectory import SECOND
from services.ros2.commands import Commands, Pending, task_state
from shared import topics
from shared.messages import PAUSED, REACHED, RUNNING, TaskRequest, TaskState
from shared.ros2.actions import ActionServer, ServerGoal, Status
from shared.ros2.types import SHAPE_ROPE
from shared.runtime.service import Inbox

if TYPE_CHECKING:
    from shared.ros2.node import Node

FEEDBACK_PERIOD = SECOND // 5
"""Time between two feedback messages [ns]."""


class RopeAction:
    """Server that executes one goal at a time; a new goal ends the former one."""

    def __init__(self, node: Node, commands: Commands, name: str) -> None:
        self._server = ActionServer(node, name, SHAPE_ROPE)
        self._commands = commands
        self._door = node.door
        self._goal: ServerGoal | None = None
        self._request: Pending | None = None
        self._starting = self._stopping = False
        self._feedback_time = 0

    def step(self, inbox: Inbox, now: int) -> tuple[()]:
        """Take goals, and go on with the one that is executed; what it asks, the commands send."""
        for goal in self._server.take():
            with self._door.guard("ROS 2 shape_rope") as outcome:
                message = self._commands.goal_of(goal.message.goal)
            if outcome.refusal:
                goal.reject()
                continue
            goal.accept()
            if self._goal is not None:
                self._end(Status.ABORTED, inbox, "another goal has taken its place")
            self._goal, self._starting, self._stopping = goal, False, False
            self._request = self._commands.request_task(TaskRequest.SET_GOAL, now, goal=message)
        if self._request is not None:
            self._follow_request(inbox, now)
        elif self._goal is not None:
            self._follow_run(inbox, now)
        return ()

    def _follow_request(self, inbox: Inbox, now: int) -> None:
        """Wait for the answer to a request; after the goal, start."""
        assert self._request is not None
        if self._request.outcome is None:
            return
        success, reason = self._request.outcome
        self._request = None
        if not success:
            self._end(Status.ABORTED, inbox, reason)
        elif self._stopping:
            self._end(Status.CANCELED, inbox, "cancelled")
        elif not self._starting and task_state(inbox).state != RUNNING:
            self._starting = True
            self._request = self._commands.request_task(TaskRequest.START, now)

    def _follow_run(self, inbox: Inbox, now: int) -> None:
        goal, state = self._goal, task_state(inbox)
        assert goal is not None
        if goal.cancel_requested:
            self._stopping = True
            self._request = self._commands.request_task(TaskRequest.STOP, now)
        elif state.state == REACHED:
            self._end(Status.SUCCEEDED, inbox, state.reason)
        elif state.state not in (RUNNING, PAUSED):
            self._end(Status.ABORTED, inbox, state.reason)
        elif now - self._feedback_time >= FEEDBACK_PERIOD:
            self._feedback_time = now
            goal.feedback(error=state.error, clearance=state.clearance, reason=state.reason)

    def _end(self, status: Status, inbox: Inbox, reason: str) -> None:
        assert self._goal is not None
        state: TaskState = task_state(inbox)
        result = inbox.latest(topics.RUN_RESULT)
        self._goal.end(
            status,
            reached=status is Status.SUCCEEDED,
            error=state.error,
            min_clearance=result.message.min_clearance if result else 0.0,
            reason=reason or TaskState.Reason.Name(state.reason_code),
        )
        self._goal = self._request = None
