"""What people asked for: turned into requests, and followed until their owner has answered."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from google.protobuf.message import Message

from lariat.geometry.poses import Pose
from shared import topics
from shared.messages import (
    ArmCommand,
    ArmStates,
    GoalDraft,
    Obstacle,
    Scene,
    SceneRequest,
    TaskRequest,
    TaskState,
    grip,
)
from shared.service import SECOND, Publication
from shared.topics import Topic

PATIENCE = 3 * SECOND
"""An owner that has not answered after this time [ns] is reported as silent."""
VALIDITY = SECOND
"""Arm commands that arrive later than this [ns] must not be carried out any more."""

OWNERS = {
    topics.TASK_REQUEST.key: "controller",
    topics.SCENE_REQUEST.key: "perception",
    topics.ARM_COMMAND.key: "robot gateway",
}


@dataclass(frozen=True)
class Unanswered:
    """A request whose answer is awaited."""

    id: str
    number: int
    words: str
    owner: str
    sent: int
    """[ns]"""


@dataclass(frozen=True)
class Complaint:
    """Why something that was asked for did not happen."""

    title: str
    reason: str


class Outbox:
    """Requests between two steps, and those not yet answered."""

    def __init__(self, session: str) -> None:
        self._session = session
        self._count = 0
        self._waiting: list[tuple[Topic, Message, str]] = []
        self._unanswered: list[Unanswered] = []

    def task(self, action: TaskRequest.Action, words: str, **fields: object) -> str:
        """Asks the controller; `words` name the wish in complaints."""
        return self._add(topics.TASK_REQUEST, TaskRequest(action=action, **fields), words)

    def scene(self, action: SceneRequest.Action, obstacle: Obstacle, words: str) -> str:
        """Asks perception to change the scene."""
        message = SceneRequest(action=action, obstacle=obstacle)
        return self._add(topics.SCENE_REQUEST, message, words)

    def arm(self, action: ArmCommand.Action, boot: str, words: str, **fields: object) -> str:
        """Commands the gateway that booted with the id `boot`, and no other."""
        return self._add(topics.ARM_COMMAND, ArmCommand(action=action, boot=boot, **fields), words)

    def draft(self, left: Pose, right: Pose) -> str:
        """Asks for the rod at rest between two grips."""
        message = GoalDraft(left=grip(left), right=grip(right))
        return self._add(topics.TASK_GOAL_DRAFT, message, "")

    def _add(self, topic: Topic, message: Message, words: str) -> str:
        self._count += 1
        message.id = f"{self._session}-{self._count}"
        self._waiting.append((topic, message, words))
        return message.id

    def take(self, now: int) -> Iterator[Publication]:
        """Everything that waits, stamped."""
        for topic, message, words in self._waiting:
            message.stamp = now
            if isinstance(message, ArmCommand):
                message.expires = now + VALIDITY
            if words:
                number = int(message.id.rpartition("-")[2])
                owner = OWNERS[topic.key]
                self._unanswered.append(Unanswered(message.id, number, words, owner, now))
            yield Publication(topic, message)
        self._waiting.clear()

    def complaints(
        self, now: int, task: TaskState | None, scene: Scene | None, arms: list[ArmStates]
    ) -> list[Complaint]:
        """Refusals of what this dashboard asked for, and silence; each once."""
        answers = [("robot gateway", a.last_command, a.refusal) for a in arms]
        if task is not None:
            answers.append(("controller", task.last_request, task.refusal))
        if scene is not None:
            answers.append(("perception", scene.last_request, scene.refusal))
        found = []
        for owner, handled, refusal in answers:
            session, _, number = handled.rpartition("-")
            if session != self._session or not number.isdigit():
                continue
            for request in [r for r in self._unanswered if r.owner == owner]:
                if request.id == handled and refusal:
                    found.append(Complaint(f"{request.words}: refused", refusal))
                # Owners handle requests in their order, and only the last one is in the state.
                if request.number <= int(number):
                    self._unanswered.remove(request)
        for request in [r for r in self._unanswered if now - r.sent > PATIENCE]:
            found.append(
                Complaint(
                    f"{request.words}: no answer",
                    f"The {request.owner} has not answered for {PATIENCE // SECOND} s.",
                )
            )
            self._unanswered.remove(request)
        return found
