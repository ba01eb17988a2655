"""One service in a recording: its traces, the inputs that they name, and its outputs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

from lariat.trajectory import SECOND
from shared import topics
from shared.messages import Trace, TraceInput
from shared.recording import Entry, Recording
from stack.replay.comparison import Difference

RECORDER_POLLING_TIME = SECOND // 10
"""Longest time between the arrival of a message and its entry in a live recording [ns]."""

Channel = tuple[str, str]
"""Topic key and publisher: the messages that are numbered together."""


class Located(NamedTuple):
    """A message and its place in the file."""

    entry: Entry
    position: int
    """Number of the message in the file, from 0."""


class TracedStep(NamedTuple):
    """One step of a service as its trace names it."""

    trace: Trace
    position: int
    """Number of the trace's message in the file, from 0."""


@dataclass
class Start:
    """One start of the service: all that one process of it left in the file."""

    steps: list[TracedStep] = field(default_factory=list)
    """In the order of their numbers, each once."""
    outputs: dict[str, list[Located]] = field(default_factory=lambda: defaultdict(list))
    """Published messages by topic, each sequence number once, in the order of the file."""
    flaws: list[Difference] = field(default_factory=list)
    """Doubled and missing messages that the file shows without a replay."""


class RecordedService:
    """What a recording holds of one service."""

    def __init__(self, recording: Recording, service: str) -> None:
        """Read the whole of a recording that `Recording.open` opened."""
        self.starts: dict[str, Start] = {}
        """By the id of each process start that left a trace."""
        self.inputs: dict[tuple[str, str, int], Entry] = {}
        """By topic, publisher and sequence number."""
        self.simulated = recording.metadata.get("time") == "simulated"
        """Whether receipt times follow from step times and latencies exactly."""
        self.begin = 0
        """Log time of the first message in the file [ns]."""
        self.end = 0
        """Log time of the last message in the file [ns]."""
        self._numbers: dict[Channel, tuple[int, int]] = {}
        self._read_traces(recording, topics.TRACE.at(service).key)
        self._read_messages(recording)
        self.damage = recording.damage
        """Why the file is cut or broken; empty when it is whole."""

    def predates(self, item: TraceInput) -> bool:
        """Whether an input that the file lacks was sent before the recording began.

        On simulated time the receipt says so. In a live recording the first message of the
        channel has a higher number: the recorder did not hear its publisher yet.
        """
        if self.simulated:
            return item.received < self.begin
        first, _ = self._numbers.get((item.topic, item.publisher), (None, None))
        if first is None:
            return item.received < self.begin + RECORDER_POLLING_TIME
        return item.sequence < first

    def outlasts(self, item: TraceInput) -> bool:
        """Whether an input that the file lacks was not yet written when the recording ended.

        Only a live recorder can be later than the reader: it takes its messages at its own rate.
        """
        if self.simulated:
            return False
        _, last = self._numbers.get((item.topic, item.publisher), (-1, -1))
        return item.sequence > last and item.received > self.end - RECORDER_POLLING_TIME

    def _read_traces(self, recording: Recording, key: str) -> None:
        numbered: dict[str, dict[int, TracedStep]] = defaultdict(dict)
        for position, entry in enumerate(recording.messages()):
            if entry.key != key:
                continue
            step = TracedStep(entry.parse(), position)
            start = self.starts.setdefault(entry.publisher, Start())
            if step.trace.step in numbered[entry.publisher]:
                start.flaws.append(_flaw(entry, "doubled", f"step {step.trace.step} twice"))
                continue
            numbered[entry.publisher][step.trace.step] = step
        for publisher, steps in numbered.items():
            start = self.starts[publisher]
            start.steps = [steps[number] for number in sorted(steps)]
            start.flaws.extend(_lost_steps(key, start.steps))
            start.flaws.extend(_doubled_inputs(start.steps))

    def _read_messages(self, recording: Recording) -> None:
        named = {
            (i.topic, i.publisher, i.sequence)
            for start in self.starts.values()
            for step in start.steps
            for i in step.trace.inputs
        }
        read = {channel for channel, *_ in named}
        seen: set[tuple[str, str, int]] = set()
        for position, entry in enumerate(recording.messages()):
            self.begin = self.begin or entry.log_time
            self.end = entry.log_time
            publishes = entry.publisher in self.starts and not _of_the_runner(entry.key)
            if not publishes and entry.key not in read:
                continue
            number = (entry.key, entry.publisher, entry.sequence)
            if number in seen:
                self._note_doubled(entry, publishes, number in named)
                continue
            seen.add(number)
            channel = (entry.key, entry.publisher)
            first, last = self._numbers.get(channel, (entry.sequence, entry.sequence))
            self._numbers[channel] = min(first, entry.sequence), max(last, entry.sequence)
            if number in named:
                self.inputs[number] = entry
            if publishes:
                self.starts[entry.publisher].outputs[entry.key].append(Located(entry, position))

    def _note_doubled(self, entry: Entry, publishes: bool, named: bool) -> None:
        if publishes:
            self.starts[entry.publisher].flaws.append(
                _flaw(entry, "doubled", f"output #{entry.sequence} twice")
            )
        elif named:
            for start in self.starts.values():
                start.flaws.append(_flaw(entry, "doubled", f"input #{entry.sequence} twice"))


def _of_the_runner(key: str) -> bool:
    return any(topic.matches(key) for topic in (topics.TRACE, topics.HEALTH, topics.LOG))


def _flaw(entry: Entry, kind: str, recorded: str) -> Difference:
    return Difference(entry.key, entry.sequence, entry.log_time, "", recorded, "once", kind=kind)


def _lost_steps(key: str, steps: list[TracedStep]) -> Iterator[Difference]:
    for (before, _), (after, _) in pairwise(steps):
        lost = after.step - before.step - 1
        if lost:
            which = f"steps {before.step + 1}…{after.step - 1}" if lost > 1 else ""
            text = f"no trace of {which or f'step {before.step + 1}'}"
            yield Difference(key, before.step + 1, after.now, "", text, "a step", kind="lost step")


def _doubled_inputs(steps: list[TracedStep]) -> Iterator[Difference]:
    taken: set[tuple[str, str, int]] = set()
    for trace, _ in steps:
        for item in trace.inputs:
            number = (item.topic, item.publisher, item.sequence)
            if number in taken:
                text = f"taken again by step {trace.step}"
                yield Difference(
                    item.topic, item.sequence, item.received, "", text, "once", kind="doubled"
                )
            taken.add(number)
