"""Requests of the page to other services, tracked until their receiver has answered."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from google.protobuf.message import Message
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.scenario import Goal
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import (
    ArmCommand,
    ArmStates,
    Consent,
    GoalDraft,
    GoalList,
    GoalListRequest,
    Obstacle,
    RunList,
    RunListRequest,
    Scene,
    SceneRequest,
    StackRequest,
    StackState,
    TaskRequest,
    TaskState,
    goal_message,
    grip,
)
from shared.runtime.service import Publication
from shared.topics import Topic

ANSWER_TIMEOUT = 3 * SECOND
"""Time after which an unanswered request is reported [ns]."""

RECEIVERS = {
    topics.TASK_REQUEST.key: "controller",
    topics.SCENE_REQUEST.key: "perception",
    topics.ARM_COMMAND.key: "robot gateway",
    topics.RUN_LIST_REQUEST.key: "recorder",
    topics.GOAL_LIST_REQUEST.key: "recorder of goals",
    topics.STACK_REQUEST.key: "launcher",
}
"""Service that answers the requests of a topic, by key."""


@dataclass(frozen=True)
class PendingRequest:
    """Request that was sent and not yet answered."""

    id: str
    """Id of the request: session and number."""
    number: int
    """Number of the request, counted by its outbox."""
    label: str
    """Name of the request in notifications."""
    receiver: str
    """Service that must answer."""
    sent: int
    """Time of sending [ns]."""


@dataclass(frozen=True)
class Notification:
    """Message to the person at the browser, e.g. why a request was refused."""

    title: str
    """First line."""
    body: str
    """Reason and details."""


class Outbox:
    """Requests made since the last step, and those that wait for an answer.

    The `label` of a request names it in notifications.
    """

    def __init__(self, session: str) -> None:
        self._session = session
        self._count = 0
        self._consents = 0
        self._unsent: list[tuple[Topic, Message, str]] = []
        self._pending: list[PendingRequest] = []

    def request_task(
        self, action: TaskRequest.Action, label: str, goal: Goal | None = None, **fields: object
    ) -> str:
        """Queue a request to the controller and return its id."""
        message = TaskRequest(action=action, goal=goal and goal_message(goal), **fields)
        return self._add(topics.TASK_REQUEST, message, label)

    def request_scene(self, action: SceneRequest.Action, obstacle: Obstacle, label: str) -> str:
        """Queue a change of the scene, which perception makes, and return its id."""
        message = SceneRequest(action=action, obstacle=obstacle)
        return self._add(topics.SCENE_REQUEST, message, label)

    def request_runs(
        self, action: RunListRequest.Action, runs: Sequence[str], label: str, **fields: object
    ) -> str:
        """Queue a request about recorded runs, by their ids, and return its id."""
        message = RunListRequest(action=action, runs=runs, **fields)
        return self._add(topics.RUN_LIST_REQUEST, message, label)

    def request_goals(
        self, action: GoalListRequest.Action, name: str, label: str, goal: Goal | None = None
    ) -> str:
        """Queue a request about the goal of a name, and return its id."""
        message = GoalListRequest(action=action, name=name, goal=goal and goal_message(goal))
        return self._add(topics.GOAL_LIST_REQUEST, message, label)

    def request_stack(self, action: StackRequest.Action, label: str, **fields: object) -> str:
        """Queue a request about scenarios to whoever runs the stack, and return its id."""
        return self._add(topics.STACK_REQUEST, StackRequest(action=action, **fields), label)

    def command_arms(
        self, action: ArmCommand.Action, arms: ArmStates, label: str, **fields: object
    ) -> str:
        """Queue a command to the gateway, whose newest state is `arms`, and return its id."""
        shown = {"boot": arms.boot, "answers": arms.stamp, "session": arms.next_session}
        message = ArmCommand(action=action, **{**shown, **fields})
        return self._add(topics.ARM_COMMAND, message, label)

    def consent(self, command: str, arms: ArmStates) -> None:
        """Queue a sign of life for an approach."""
        self._consents += 1
        message = Consent(
            command=command, boot=arms.boot, sequence=self._consents, answers=arms.stamp
        )
        self._unsent.append((topics.ARM_CONSENT, message, ""))

    def draft_goal(
        self,
        left: Pose,
        right: Pose,
        turns: float,
        pull: tuple[int, Float64[np.ndarray, "3"]] | None = None,
    ) -> str:
        """Request the rod's rest shape between two grips with whole turns of twist; return the id.

        A pull is a node and its place, to which the grips give way.
        """
        message = GoalDraft(left=grip(left), right=grip(right), turns=turns)
        if pull is not None:
            message.node, message.pull[:] = pull
        return self._add(topics.TASK_GOAL_DRAFT, message, "")

    def new_id(self) -> str:
        """Return the id of another request."""
        self._count += 1
        return f"{self._session}-{self._count}"

    def _add(self, topic: Topic, message: Any, label: str) -> str:
        message.id = self.new_id()
        self._unsent.append((topic, message, label))
        return message.id

    def take(self, now: int) -> Iterator[Publication]:
        """Remove and yield all queued requests, stamped with `now` [ns]."""
        for topic, message, label in self._unsent:
            message.stamp = now  # pyright: ignore[reportAttributeAccessIssue]
            if label:
                number = int(message.id.rpartition("-")[2])  # pyright: ignore[reportAttributeAccessIssue]
                receiver = RECEIVERS[topic.key]
                self._pending.append(PendingRequest(message.id, number, label, receiver, now))  # pyright: ignore[reportAttributeAccessIssue]
            yield Publication(topic, message)
        self._unsent.clear()

    def notifications(
        self,
        now: int,
        task: TaskState | None,
        scene: Scene | None,
        arms: Sequence[ArmStates],
        runs: RunList | None = None,
        stack: StackState | None = None,
        goals: GoalList | None = None,
    ) -> list[Notification]:
        """Return refusals of this page's requests and missing answers, each of them once."""
        answers = [("robot gateway", a.last_command, a.refusal) for a in arms]
        for receiver, state in (
            ("controller", task),
            ("recorder", runs),
            ("recorder of goals", goals),
            ("launcher", stack),
            ("perception", scene),
        ):
            if state is not None:
                answers.append((receiver, state.last_request, state.refusal))
        notices = []
        for receiver, answered_id, refusal in answers:
            session, _, number = answered_id.rpartition("-")
            if session != self._session or not number.isdigit():
                continue
            for request in [r for r in self._pending if r.receiver == receiver]:
                if request.id == answered_id and refusal:
                    notices.append(Notification(f"{request.label}: refused", refusal))
                # Requests are handled in order, and a state names only the last one.
                if request.number <= int(number):
                    self._pending.remove(request)
        for request in [r for r in self._pending if now - r.sent > ANSWER_TIMEOUT]:
            notices.append(
                Notification(
                    f"{request.label}: no answer",
                    f"The {request.receiver} has not answered for {ANSWER_TIMEOUT // SECOND} s.",
                )
            )
            self._pending.remove(request)
        return notices
