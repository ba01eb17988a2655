"""Recorder service: writes every message of the bus and draws the cell for viewers."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence

from lariat.arms.description import with_own_urdfs
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from services.recorder.goals.goals import Goals
from services.recorder.options import RecorderOptions
from services.recorder.retention import space
from services.recorder.run_files import RunFiles
from services.recorder.runs.runs import Runs
from services.recorder.view.cell_view import WRITES, CellView
from shared import topics
from shared.arm_rest import stands
from shared.bus import RawMessage
from shared.door import Door
from shared.messages import ArmStates, RecordState, validation
from shared.runtime.service import Inbox, Publication
from shared.topics import Topic

log = logging.getLogger(__name__)

OWN_WRITES = (
    topics.RUN_RECORD,
    topics.RUN_LIST,
    topics.RUN_CURVES,
    topics.RUN_MOTION,
    topics.RUN_PICTURE,
    topics.RUN_VIDEO,
    topics.GOAL_LIST,
)
"""Topics on which it publishes, beside the drawing."""
LATE_DRAWING = 5.0
"""Lateness of a step from which it draws nothing [-]."""
MAX_STREAMS = 4096
"""Most pairs of topic and publisher whose numbers are remembered, and most keys."""
MAX_LOSS = 1_000_000
"""Most messages that one gap in a publisher's numbers counts for: numbers can be made up."""


class RecorderService:
    """Recorder whose `tap` writes messages and whose steps open, flush and close files."""

    name = "recorder"
    reads = (topics.RUN_LIST_REQUEST, topics.GOAL_LIST_REQUEST)
    writes: Sequence[Topic] = (*OWN_WRITES, *WRITES, topics.VIEW_POINTS)
    rate = 30.0
    latency = 0.0

    def __init__(self, scenario: Scenario, options: RecorderOptions) -> None:
        self.door = Door()
        self._folder = options.folder
        self._files = RunFiles(scenario, options)
        self._runs = Runs(scenario, options.folder, self.door)
        self._goals = Goals(scenario, options.folder, self.door)
        self._view = CellView(scenario)
        self.writes = (*OWN_WRITES, *self._view.writes)
        self._known: dict[str, bool] = {}
        self._next_sequence: dict[tuple[str, str], int] = {}
        self._drops = 0
        self._published: tuple[bool, str, str] | None = None
        self._publish_time = 0
        self.note = ""

    def warm_up(self) -> None:
        """List the runs and the goals of the folder."""
        self._runs.load()
        self._goals.load()

    def tap(self, message: RawMessage) -> None:
        """Take a message of the bus."""
        if not self._is_known(message.key):
            return
        self._count_drops(message)
        with self.door.guard(message.key):
            self._follow(message)
        self._files.put(message)
        with self.door.guard(message.key):
            self._view.take(message.key, message.payload)

    def _follow(self, message: RawMessage) -> None:
        """Follow runs and the motion of the arms."""
        if message.key == topics.TASK_STATE.key:
            task = validation.decode(topics.TASK_STATE, message.payload)
            self._files.take_task(task, message.received)
            self._runs.take_task(task)
        elif message.key == topics.RUN_RESULT.key:
            self._runs.take_result(validation.decode(topics.RUN_RESULT, message.payload))
        elif message.key == topics.ARM_STATE.key and _is_moving(message.payload):
            self._files.take_motion(message.received)

    def _count_drops(self, message: RawMessage) -> None:
        stream = message.key, message.publisher
        expected = self._next_sequence.pop(stream, message.sequence)
        self._drops += min(max(0, message.sequence - expected), MAX_LOSS)
        self._next_sequence[stream] = message.sequence + 1
        if len(self._next_sequence) > MAX_STREAMS:
            del self._next_sequence[next(iter(self._next_sequence))]

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Open, flush and close files; publish the drawing and the recorder's state."""
        self._files.tick(now)
        if self._files.failure != self.note:
            self.note = self._files.failure
            if self.note:
                log.error("not recording: %s", self.note)
        if self._files.lateness < LATE_DRAWING:
            with self.door.guard("the drawing of the cell"):
                yield from self._view.draw(now)
        writer = self._files.writer
        if self._files.late is not None:
            self._runs.take_late_file(*self._files.late)
            self._files.late = None
        requests = [item.message for item in inbox.every(topics.RUN_LIST_REQUEST)]
        yield from self._runs.step(requests, writer.path.name if writer else "", now)
        goal_requests = [item.message for item in inbox.every(topics.GOAL_LIST_REQUEST)]
        yield from self._goals.step(goal_requests, now)
        state = (writer is not None, str(writer.path) if writer else "", self._files.run)
        if state != self._published or now - self._publish_time >= SECOND:
            if state != self._published and writer:
                log.info("recording %s to %s", self._files.run or "idle cell", writer.path)
            self._published, self._publish_time = state, now
            recording, file, run = state
            size, free = space(self._folder)
            yield Publication(
                topics.RUN_RECORD,
                RecordState(
                    stamp=now,
                    recording=recording,
                    file=file,
                    bytes=writer.bytes if writer else 0,
                    messages=writer.messages if writer else 0,
                    drops=self._drops + self._files.lost,
                    run=run,
                    recordings_size=size,
                    free_space=free,
                ),
            )

    def close(self) -> None:
        """Close the open file, and keep the run that goes on."""
        self._files.close()
        self._runs.close()

    def _is_known(self, key: str) -> bool:
        """Whether a key is that of a topic, not of another program or version of Lariat."""
        if key not in self._known:
            try:
                topics.find(key)
                self._known[key] = True
            except KeyError as error:
                log.warning("not recorded: %s", error)
                self._known[key] = False
            if len(self._known) > MAX_STREAMS:
                del self._known[next(iter(self._known))]
        return self._known.get(key, False)


def _is_moving(payload: bytes) -> bool:
    """Whether an arm moves; one that holds a goal follows setpoints at rest."""
    states = ArmStates.FromString(payload)
    return states.mode == ArmStates.MOVING and not all(map(stands, states.arms))


def build(
    scenario: Scenario, session: str, options: RecorderOptions | None = None
) -> RecorderService:
    """Build the recorder of a scenario."""
    return RecorderService(with_own_urdfs(scenario), options or RecorderOptions())
