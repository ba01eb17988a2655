"""Services whose inputs do not all stand in their traces, built for replay.

* The recorder hears every message of the bus. A recording is what it heard, in order: the replay
  hands it the same messages and lets it write its own file into a temporary folder.
* The dashboard is operated by people in a browser. The requests that it published tell what they
  asked for; the replay asks again, and the dashboard has to number, stamp and address the requests
  as it did.
* The camera's frames come from a device or a file. The recording's metadata names the file; frames
  of a device cannot be replayed.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from shared import topics
from shared.bus import RawMessage
from shared.messages import ArmStates, grip_pose
from shared.recording import Entry, Recording
from shared.runtime.free_port import free_port
from shared.runtime.service import Inbox, Publication, Service
from stack import services
from stack.replay.recorded_service import RecordedService, TracedStep

COMMAND_FIELDS = ("arm", "close", "approach_distance", "approach_angle", "session")
"""Fields of a command to the arms that a person gives."""
CAMERA_RECORDING = "camera_recording"
"""Metadata key: file of the camera's frames, relative to the recording."""


class NotReplayable(ConfigurationError):
    """The recording does not hold what the service took from outside of the bus."""


class Subject(NamedTuple):
    """A service that is ready to be replayed."""

    service: Service
    feed: Callable[[TracedStep], None] | None = None
    """Hands over, before each step, what came from outside of the inbox."""


@contextmanager
def subject(
    name: str, scenario: Scenario, session: str, recording: Recording, recorded: RecordedService
) -> Iterator[Subject]:
    """A service with what it needs from outside of the bus, closed when the block ends."""
    match name:
        case "camera":
            with _camera(scenario, session, recording) as camera:
                yield Subject(camera)
        case "recorder":
            with _recorder(scenario, session, recording, recorded) as recorder:
                yield Subject(recorder, recorder.feed)
        case "dashboard":
            with _dashboard(scenario, session, recorded) as dashboard:
                yield dashboard
        case _:
            began = recorded.starts[session].steps[0].trace.now
            yield Subject(services.build(name, scenario, session, began))


@contextmanager
def _camera(scenario: Scenario, session: str, recording: Recording) -> Iterator[Any]:
    from services.camera.options import CameraOptions
    from services.camera.service import build

    source = recording.metadata.get(CAMERA_RECORDING)
    if source is None:
        raise NotReplayable(
            f"{recording.path} does not say which file the camera played: its frames came from a "
            "device, or from a file that is not named in the recording"
        )
    service = build(scenario, session, CameraOptions(recording.path.parent / source))
    try:
        yield service
    finally:
        service.close()


@dataclass
class RecorderSubject:
    """A recorder that hears a recording again."""

    service: Any
    session: str
    messages: Iterator[tuple[int, Entry]]
    folder: str
    """Where the recorded one wrote its files."""
    name: str = "recorder"
    waiting: list[tuple[int, Entry]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.reads, self.writes = self.service.reads, self.service.writes
        self.rate, self.latency = self.service.rate, self.service.latency

    def warm_up(self) -> None:
        """Compile nothing."""

    def feed(self, step: TracedStep) -> None:
        """Hand over what was received before a step; on simulated time the file's order decides."""
        while True:
            following = self.waiting.pop() if self.waiting else next(self.messages, None)
            if following is None:
                return
            position, entry = following
            own = entry.publisher == self.session and entry.log_time >= step.trace.now
            if own or entry.log_time > step.trace.now or position >= step.position:
                self.waiting.append(following)
                return
            self.service.tap(
                RawMessage(
                    entry.key,
                    entry.schema,
                    entry.payload,
                    entry.publisher,
                    entry.sequence,
                    entry.log_time,
                    published=entry.publish_time,
                )
            )

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Step the recorder; its file is named in the folder of the recorded one.

        What no recording holds is left out.
        """
        for topic, message in self.service.step(inbox, now):
            if topic.key == topics.RUN_RECORD.key and message.file:
                message.file = str(Path(self.folder) / Path(message.file).name)
            if not topic.recorded:
                continue
            yield Publication(topic, message)


@contextmanager
def _recorder(
    scenario: Scenario, session: str, recording: Recording, recorded: RecordedService
) -> Iterator[RecorderSubject]:
    from services.recorder.options import RecorderOptions
    from services.recorder.service import build

    files = [
        message.file
        for entry, _ in recorded.starts[session].outputs.get(topics.RUN_RECORD.key, [])
        if (message := entry.parse()).file
    ]
    folder = str(Path(files[0]).parent) if files else ""
    with tempfile.TemporaryDirectory() as place:
        service = build(scenario, session, RecorderOptions(Path(place), least_free=0.0))
        try:
            yield RecorderSubject(service, session, enumerate(recording.messages()), folder)
        finally:
            service.close()


@contextmanager
def _dashboard(scenario: Scenario, session: str, recorded: RecordedService) -> Iterator[Subject]:
    from dashboard.options import DashboardOptions
    from dashboard.service import build

    asked = sorted(
        (located for outputs in recorded.starts[session].outputs.values() for located in outputs),
        key=lambda located: located.position,
        reverse=True,
    )

    def feed(step: TracedStep) -> None:
        # A step's requests stand before its trace.
        while asked and asked[-1].position < step.position:
            _ask_again(service.outbox, asked.pop().entry)

    service = build(scenario, session, DashboardOptions(port=free_port()))
    service.warm_up()
    try:
        yield Subject(service, feed)
    finally:
        service.close()


def _ask_again(outbox: Any, entry: Entry) -> None:
    """Put what a person asked for into the outbox, without id and stamp."""
    message = entry.parse()
    words = f"request #{entry.sequence} of the recording"
    fields = {f.name: value for f, value in message.ListFields()}
    options = {k: v for k, v in fields.items() if k not in ("id", "stamp", "action")}
    match entry.key:
        case topics.TASK_REQUEST.key:
            outbox.request_task(message.action, words, **options)
        case topics.SCENE_REQUEST.key:
            outbox.request_scene(message.action, message.obstacle, words)
        case topics.ARM_COMMAND.key:
            given = {k: v for k, v in fields.items() if k in COMMAND_FIELDS}
            outbox.command_arms(message.action, _answered_state(message), words, **given)
        case topics.ARM_CONSENT.key:
            outbox.consent(message.command, _answered_state(message))
        case topics.TASK_GOAL_DRAFT.key:
            grips = grip_pose(message.left), grip_pose(message.right)
            outbox.draft_goal(*grips, message.turns)
        case topics.RUN_LIST_REQUEST.key:
            options = {"note": message.note, "star": message.star, "time": message.time}
            outbox.request_runs(message.action, list(message.runs), words, **options)
        case topics.GOAL_LIST_REQUEST.key:
            outbox.request_goals(message.action, message.name, words, message.goal)
        case topics.STACK_REQUEST.key:
            outbox.request_stack(message.action, words, **options)


def _answered_state(message: Any) -> ArmStates:
    """State of the gateway that a command or a sign of life answers."""
    return ArmStates(boot=message.boot, stamp=message.answers)
