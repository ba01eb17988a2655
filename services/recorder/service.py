"""Records everything that the cell says, and draws it for viewers."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Protocol

from services.recorder.foxglove_scene import View
from services.recorder.options import RecorderOptions
from services.recorder.run_files import RunFiles
from shared import topics
from shared.messages import RecordState, TaskState
from shared.scenario import Scenario
from shared.service import SECOND, Inbox, Publication
from shared.topics import Topic

log = logging.getLogger(__name__)


class Heard(Protocol):
    """A message as it crossed the bus, not yet decoded."""

    @property
    def key(self) -> str: ...
    @property
    def payload(self) -> bytes: ...
    @property
    def publisher(self) -> str: ...
    @property
    def sequence(self) -> int: ...
    @property
    def received(self) -> int: ...


class RecorderService:
    """Writes what `tap` is given; its steps open, flush and end files."""

    name = "recorder"
    reads = ()
    writes = (topics.RUN_RECORD, topics.VIEW_SCENE)
    rate = 30.0
    latency = 0.0

    def __init__(self, scenario: Scenario, options: RecorderOptions) -> None:
        self._files = RunFiles(scenario, options)
        self._view = View(scenario)
        self._topics: dict[str, Topic | None] = {}
        self._next: dict[tuple[str, str], int] = {}
        self._drops = 0
        self._said: tuple[bool, str, str] | None = None
        self._said_at = 0
        self.note = ""

    def warm_up(self) -> None:
        """Nothing is compiled here."""

    def tap(self, heard: Heard) -> None:
        """Takes one message of the bus."""
        topic = self._topic(heard.key)
        if topic is None:
            return
        expected = self._next.get((heard.key, heard.publisher), heard.sequence)
        self._drops += max(0, heard.sequence - expected)
        self._next[heard.key, heard.publisher] = heard.sequence + 1
        if heard.key == topics.TASK_STATE.key:
            self._files.take_task(TaskState.FromString(heard.payload), heard.received)
        self._files.write(topic, heard.payload, heard.publisher, heard.sequence, heard.received)
        self._view.take(heard.key, heard.payload)

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Looks after the files and draws the cell."""
        self._files.tick(now)
        if self._files.trouble != self.note:
            self.note = self._files.trouble
            if self.note:
                log.error("not recording: %s", self.note)
        yield Publication(topics.VIEW_SCENE, self._view.draw(now))
        writer = self._files.writer
        said = (writer is not None, str(writer.path) if writer else "", self._files.run)
        if said != self._said or now - self._said_at >= SECOND:
            if said != self._said and writer:
                log.info("recording %s to %s", self._files.run or "idle cell", writer.path)
            self._said, self._said_at = said, now
            recording, file, run = said
            yield Publication(
                topics.RUN_RECORD,
                RecordState(
                    stamp=now,
                    recording=recording,
                    file=file,
                    bytes=writer.bytes if writer else 0,
                    messages=writer.messages if writer else 0,
                    drops=self._drops,
                    run=run,
                ),
            )

    def close(self) -> None:
        """Ends the open file."""
        self._files.close()

    def _topic(self, key: str) -> Topic | None:
        if key not in self._topics:
            try:
                self._topics[key] = topics.find(key)
            except KeyError as error:
                # Somebody else's key, or another version of Lariat.
                log.warning("not recorded: %s", error)
                self._topics[key] = None
        return self._topics[key]


def build(
    scenario: Scenario, session: str, options: RecorderOptions | None = None
) -> RecorderService:
    """The recorder of a scenario's cell."""
    return RecorderService(scenario, options or RecorderOptions())
