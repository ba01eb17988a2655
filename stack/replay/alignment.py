"""Which recorded message belongs to which published one.

On simulated time a message is received exactly one latency after its step, so each step's messages
are known. In a live recording messages are matched by their numbers, and the order of the file says
which step a message belongs to at the ends.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from lariat.trajectory import SECOND
from shared import topics
from shared.recording import Entry
from shared.runtime.service import Publication, Service
from stack.replay.comparison import Difference
from stack.replay.recorded_service import RECORDER_POLLING_TIME, RecordedService, Start, TracedStep


class Pair(NamedTuple):
    """A published message beside the recorded one; None where there is none."""

    published: Publication | None
    recorded: Entry | None
    sequence: int
    unrecorded: bool = False
    """The file shows why it lacks the recorded message."""


class Alignment(ABC):
    """Pairs the messages of one start, step by step."""

    def __init__(self, recorded: RecordedService, start: Start) -> None:
        self._recorded = recorded
        self._outputs = start.outputs
        self._steps = start.steps
        self.under_way: Counter[str] = Counter()
        """Published messages by topic that were still under way when the recording ended."""
        self.untraced: Counter[str] = Counter()
        """Recorded messages by topic whose step's trace lies behind the end of a file."""
        self.unheard: Counter[str] = Counter()
        """Published messages by topic that a live recorder missed between two others."""

    @abstractmethod
    def step(self, step: TracedStep, published: Sequence[Publication]) -> Iterator[Pair]:
        """Pairs of one step."""

    @abstractmethod
    def unclaimed(self) -> Iterator[Difference]:
        """Recorded messages that no step published, after the last step."""


def aligned(recorded: RecordedService, start: Start, service: Service) -> Alignment:
    """The alignment that fits how the recording came about."""
    if recorded.simulated:
        return _ByTime(recorded, start, round(service.latency * SECOND))
    return _ByNumber(recorded, start)


class _ByTime(Alignment):
    """Messages of a simulated recording, by the instant at which they become visible."""

    def __init__(self, recorded: RecordedService, start: Start, latency: int) -> None:
        super().__init__(recorded, start)
        self._latency = latency
        self._due: dict[int, dict[str, list[Entry]]] = defaultdict(dict)
        for key, outputs in start.outputs.items():
            for entry, _ in outputs:
                self._due[entry.log_time].setdefault(key, []).append(entry)
        self._next: dict[str, int] = defaultdict(int)

    def step(self, step: TracedStep, published: Sequence[Publication]) -> Iterator[Pair]:
        due = step.trace.now + self._latency
        waiting = self._due.pop(due, {})
        # The cut of a damaged file may lie between two messages of one instant.
        later = due > self._recorded.end or (due == self._recorded.end and self._recorded.damage)
        for publication in published:
            key = publication.topic.key
            entries = waiting.get(key)
            entry = entries.pop(0) if entries else None
            sequence = entry.sequence if entry else self._next[key]
            self._next[key] = sequence + 1
            if entry is None and later:
                self.under_way[key] += 1
            yield Pair(publication, entry, sequence, bool(later))
        for entries in waiting.values():
            for entry in entries:
                yield Pair(None, entry, entry.sequence)

    def unclaimed(self) -> Iterator[Difference]:
        first, last = self._steps[0].trace, self._steps[-1].trace
        for due, waiting in sorted(self._due.items()):
            said = due - self._latency
            for key, entries in waiting.items():
                if first.step and said < first.now:
                    continue
                if self._recorded.damage and said > last.now:
                    self.untraced[key] += len(entries)
                    continue
                for entry in entries:
                    yield of_no_step(entry)


class _ByNumber(Alignment):
    """Messages of a live recording, by their numbers."""

    def __init__(self, recorded: RecordedService, start: Start) -> None:
        super().__init__(recorded, start)
        self._by_number = {
            key: {entry.sequence: entry for entry, _ in outputs}
            for key, outputs in start.outputs.items()
        }
        self._next = {key: self._first(key) for key in start.outputs}

    def step(self, step: TracedStep, published: Sequence[Publication]) -> Iterator[Pair]:
        for publication in published:
            key = publication.topic.key
            sequence = self._next.setdefault(key, 0)
            self._next[key] += 1
            numbered = self._by_number.get(key, {})
            entry = numbered.get(sequence)
            # A later number is in the file: this one was sent and the recorder was too slow.
            missed = entry is None and sequence < max(numbered, default=-1)
            # Images have the lowest priority on the bus; all else is sent before its trace.
            late = (
                entry is None
                and topics.find(key).large
                and step.trace.now > self._recorded.end - RECORDER_POLLING_TIME
            )
            if missed:
                self.unheard[key] += 1
            elif late:
                self.under_way[key] += 1
            yield Pair(publication, entry, sequence, missed or late)

    def unclaimed(self) -> Iterator[Difference]:
        end = self._steps[-1].position
        for key, outputs in self._outputs.items():
            for entry, position in outputs:
                if entry.sequence < self._next[key]:
                    continue
                if position > end:
                    self.untraced[key] += 1
                else:
                    yield of_no_step(entry)

    def _first(self, key: str) -> int:
        """Number of the first message on a topic that the traced steps sent."""
        if self._steps[0].trace.step == 0:
            return 0
        began = self._steps[0].trace.now
        after = [e.sequence for e, _ in self._outputs[key] if e.log_time >= began]
        return min(after, default=0)


def of_no_step(entry: Entry) -> Difference:
    """Return the difference of a recorded message that no step published."""
    return Difference(
        entry.key, entry.sequence, entry.log_time, "", entry.schema, "nothing", kind="lacks"
    )
