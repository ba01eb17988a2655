"""Servers and clients of actions: goals that take a while, with feedback and a result."""

from __future__ import annotations

import secrets
import time
from collections import deque
from collections.abc import Iterator
from enum import IntEnum
from typing import Any

import numpy as np

from lariat.trajectory import SECOND
from shared.ros2 import types
from shared.ros2.node import Call, Node, Request
from shared.ros2.types import ros
from shared.ros2.wire import LATCHED

RESULT_TIME = 900 * SECOND
"""Time for which the result of a goal can be asked for after its end [ns], as in rcl."""
MAX_GOALS = 64
"""Most goals that are remembered; the oldest that have ended go first."""
REPLY_TIMEOUT = 5.0
"""Longest wait for the answer to a goal or a cancellation [s]."""
MAX_DURATION = 7 * 86400.0
"""Longest wait for a result [s]."""


class Status(IntEnum):
    """Status of a goal, as in action_msgs/GoalStatus."""

    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class ServerGoal:
    """Goal that a client has sent."""

    def __init__(self, server: ActionServer, id: bytes, request: Request) -> None:
        self.id = id
        """Its UUID."""
        self.message = request.message.goal
        """Goal message."""
        self.status: Status | None = None
        """Status; None until it is accepted or rejected."""
        self.cancel_requested = False
        """Whether a client wants it to end."""
        self.accepted_at = self.ended_at = 0
        """System times [ns]."""
        self._server = server
        self._request = request
        self._waiting: list[Request] = []
        self._result: Any = None

    @property
    def active(self) -> bool:
        """Whether it has been accepted and has not ended."""
        return self.status is not None and self.status < Status.SUCCEEDED

    def accept(self) -> None:
        """Accept it, once; its execution begins."""
        self.status, self.accepted_at = Status.EXECUTING, time.time_ns()
        self._answer(accepted=True)

    def reject(self) -> None:
        """Reject it."""
        self._answer(accepted=False)

    def feedback(self, **fields: Any) -> None:
        """Publish feedback with the fields of the action's feedback."""
        self._server.publish_feedback(self, fields)

    def end(self, status: Status, **fields: Any) -> None:
        """End it with the fields of the action's result."""
        self.status, self.ended_at = status, time.time_ns()
        self._result = ros(f"{self._server.kind}_Result", **fields)
        for request in self._waiting:
            self.give_result(request)
        self._waiting.clear()
        self._server.publish_status()

    def give_result(self, request: Request) -> None:
        """Answer a request for its result, now or at its end."""
        if self._result is None:
            # Those who have gone are not waited for.
            self._waiting = [*self._waiting[-MAX_GOALS:], request]
            return
        response = f"{self._server.kind}_GetResult_Response"
        request.reply(ros(response, status=int(self.status or 0), result=self._result))

    def _answer(self, accepted: bool) -> None:
        response = f"{self._server.kind}_SendGoal_Response"
        self._request.reply(ros(response, accepted=accepted, stamp=types.time(self.accepted_at)))


class ActionServer:
    """Server of one action."""

    def __init__(self, node: Node, name: str, kind: str) -> None:
        """Serve an action; a name without leading slash lies in the node's namespace."""
        self.kind = kind
        self._goals: dict[bytes, ServerGoal] = {}
        parts = f"{name}/_action"
        self._send = node.service(f"{parts}/send_goal", f"{kind}_SendGoal")
        self._cancel = node.service(f"{parts}/cancel_goal", "action_msgs/srv/CancelGoal")
        self._results = node.service(f"{parts}/get_result", f"{kind}_GetResult")
        self._feedback = node.publisher(f"{parts}/feedback", f"{kind}_FeedbackMessage")
        self._status = node.publisher(f"{parts}/status", "action_msgs/msg/GoalStatusArray", LATCHED)

    def take(self) -> Iterator[ServerGoal]:
        """Yield the goals since the last call, to be accepted or rejected; answer the rest."""
        for request in self._send.take():
            goal = ServerGoal(self, bytes(request.message.goal_id.uuid), request)
            if goal.id in self._goals:
                goal.reject()
                continue
            yield goal
            # One that has ended already has a result that is asked for.
            if goal.status is not None:
                self._remember(goal)
        for request in self._cancel.take():
            self._answer_cancel(request)
        for request in self._results.take():
            self._answer_result(request)

    def publish_feedback(self, goal: ServerGoal, fields: dict[str, Any]) -> None:
        """Publish feedback of a goal."""
        feedback = ros(f"{self.kind}_Feedback", **fields)
        message = f"{self.kind}_FeedbackMessage"
        self._feedback.put(ros(message, goal_id=_uuid(goal.id), feedback=feedback))

    def publish_status(self) -> None:
        """Publish the status of all goals."""
        status = [
            ros("action_msgs/msg/GoalStatus", goal_info=_info(goal), status=int(goal.status or 0))
            for goal in self._goals.values()
        ]
        self._status.put(ros("action_msgs/msg/GoalStatusArray", status_list=status))

    def _remember(self, goal: ServerGoal) -> None:
        self._goals[goal.id] = goal
        ended = [g for g in self._goals.values() if not g.active]
        surplus = len(self._goals) - MAX_GOALS
        for k, old in enumerate(ended):
            if k < surplus or time.time_ns() - old.ended_at > RESULT_TIME:
                del self._goals[old.id]
        self.publish_status()

    def _answer_cancel(self, request: Request) -> None:
        """Ask for the end of goals, by id, up to a time, or of all, as rcl does."""
        info = request.message.goal_info
        id, stamp = bytes(info.goal_id.uuid), types.nanoseconds(info.stamp)
        every = not any(id) and not stamp
        goals = [g for g in self._goals.values() if g.active and not g.cancel_requested]
        named = [g for g in goals if every or g.id == id or 0 < g.accepted_at <= stamp]
        for goal in named:
            goal.status, goal.cancel_requested = Status.CANCELING, True
        # A single goal that is not named: it has ended, or is unknown.
        code = 0 if named or every or stamp else 3 if id in self._goals else 2
        response = "action_msgs/srv/CancelGoal_Response"
        request.reply(ros(response, return_code=code, goals_canceling=list(map(_info, named))))
        self.publish_status()

    def _answer_result(self, request: Request) -> None:
        goal = self._goals.get(bytes(request.message.goal_id.uuid))
        if goal:
            goal.give_result(request)
        else:
            # Status 0, unknown, as rclcpp and rclpy: a refusal would leave their clients waiting.
            request.reply(ros(f"{self.kind}_GetResult_Response"))


class ClientGoal:
    """Goal that has been sent to a server."""

    def __init__(self, client: ActionClient, id: bytes, call: Call) -> None:
        self.id = id
        """Its UUID."""
        self.feedback: deque[Any] = deque(maxlen=16)
        """Newest feedback messages; the receiver removes what it has read."""
        self.accepted: bool | None = None
        """Whether the server accepts it; None before its answer."""
        self.status: Status | None = None
        """How it ended; None before."""
        self.result: Any = None
        """Result message at its end."""
        self._client = client
        self._call = call
        self._cancelled: Call | None = None

    def cancel(self) -> None:
        """Ask for its end."""
        self._cancelled = self._client.send_cancel(self.id)

    def poll(self) -> None:
        """Take what the server has answered.

        ValueError: refused, or nonsense. TimeoutError: the server does not answer.
        """
        self._client.take_feedback()
        if self._cancelled and self._cancelled.take() is not None:
            self._cancelled = None
        answer = self._call.take() if self.accepted is None or self.status is None else None
        if answer is None:
            return
        if self.accepted is None:
            self.accepted = bool(answer.accepted)
            if self.accepted:
                self._call = self._client.ask_result(self.id)
        elif self.accepted:
            self.status, self.result = Status(answer.status), answer.result
            self._client.forget(self.id)


class ActionClient:
    """Client of one action."""

    def __init__(self, node: Node, name: str, kind: str) -> None:
        """Use an action; see `ActionServer`."""
        self.kind = kind
        self._goals: dict[bytes, ClientGoal] = {}
        parts = f"{name}/_action"
        self._send = node.client(f"{parts}/send_goal", f"{kind}_SendGoal")
        self._cancel = node.client(f"{parts}/cancel_goal", "action_msgs/srv/CancelGoal")
        self._results = node.client(f"{parts}/get_result", f"{kind}_GetResult")
        self._feedback = node.subscription(f"{parts}/feedback", f"{kind}_FeedbackMessage")

    @property
    def matched(self) -> bool:
        """Whether a server is there."""
        return self._send.matched and self._cancel.matched and self._results.matched

    def send(self, goal: Any) -> ClientGoal:
        """Send a goal message."""
        id = secrets.token_bytes(16)
        request = ros(f"{self.kind}_SendGoal_Request", goal_id=_uuid(id), goal=goal)
        sent = ClientGoal(self, id, self._send.call(request, REPLY_TIMEOUT))
        self._goals[id] = sent
        return sent

    def send_cancel(self, id: bytes) -> Call:
        """Ask for the end of a goal."""
        info = ros("action_msgs/msg/GoalInfo", goal_id=_uuid(id), stamp=types.time(0))
        request = ros("action_msgs/srv/CancelGoal_Request", goal_info=info)
        return self._cancel.call(request, REPLY_TIMEOUT)

    def ask_result(self, id: bytes) -> Call:
        """Ask for the result of a goal, which comes at its end."""
        request = ros(f"{self.kind}_GetResult_Request", goal_id=_uuid(id))
        return self._results.call(request, MAX_DURATION)

    def take_feedback(self) -> None:
        """Hand the feedback that has arrived to its goals."""
        for message in self._feedback.take():
            goal = self._goals.get(bytes(message.goal_id.uuid))
            if goal:
                goal.feedback.append(message.feedback)

    def forget(self, id: bytes) -> None:
        """Drop a goal that has ended."""
        self._goals.pop(id, None)


def _uuid(id: bytes) -> Any:
    return ros("unique_identifier_msgs/msg/UUID", uuid=np.frombuffer(id, np.uint8))


def _info(goal: ServerGoal) -> Any:
    stamp = types.time(goal.accepted_at)
    return ros("action_msgs/msg/GoalInfo", goal_id=_uuid(goal.id), stamp=stamp)
