"""Steps a service again through the inputs that its trace names, and compares what it says."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from shared import topics
from shared.messages import Message, Trace
from shared.recording import Entry, Recording
from shared.service import Inbox, Received, Service
from shared.topics import Topic
from stack.replay.comparison import Difference, field_differences


@dataclass
class Retraced:
    """One start of a service, stepped again."""

    service: str
    session: str
    """Id of that start."""
    steps: int = 0
    compared: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    """Messages by topic that stand in the recording and were said again."""
    differences: list[Difference] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """What the recording lacks for a faithful replay."""
    outputs: list[Entry] = field(default_factory=list)
    """What was said again, with the log times of the recording."""

    @property
    def same(self) -> bool:
        return not self.differences


class Evidence:
    """What a recording says of one service: its traces, their inputs, and its outputs."""

    def __init__(self, recording: Recording, service: str) -> None:
        self.traces: dict[str, list[Trace]] = defaultdict(list)
        """Of every start of the service, in the order of its steps."""
        self.inputs: dict[tuple[str, str, int], Entry] = {}
        """By topic, publisher and sequence."""
        self.outputs: dict[str, dict[str, dict[int, Entry]]] = {}
        """By session, topic and sequence."""
        for entry in recording.messages([topics.TRACE.at(service).key]):
            self.traces[entry.publisher].append(entry.parse())
        read = {i.topic for traces in self.traces.values() for t in traces for i in t.inputs}
        said: dict[str, list[Entry]] = defaultdict(list)
        for entry in recording.messages():
            if entry.key in read:
                self.inputs[entry.key, entry.publisher, entry.sequence] = entry
            if entry.publisher in self.traces and not _of_the_runner(entry.key):
                said[entry.publisher].append(entry)
        for session, traces in self.traces.items():
            traces.sort(key=lambda trace: trace.step)
            self.outputs[session] = defaultdict(dict)
            for entry in said[session]:
                self.outputs[session][entry.key][entry.sequence] = entry


def _of_the_runner(key: str) -> bool:
    return any(topic.matches(key) for topic in (topics.TRACE, topics.HEALTH, topics.LOG))


def retrace(
    evidence: Evidence, service: Service, session: str, watch: Callable[[float], None] | None = None
) -> Retraced:
    """Steps a fresh service as one of its starts was stepped.

    Args:
        evidence: Of this service.
        service: Built as then, with the same session.
        session: Which start.
        watch: Told the fraction done.
    """
    traces, recorded = evidence.traces[session], evidence.outputs[session]
    result = Retraced(service.name, session)
    _note_gaps(result, traces, service.rate)
    newest: dict[str, Received] = {}
    sequences = {key: _first(outputs, traces) for key, outputs in recorded.items()}
    missing = 0
    for count, trace in enumerate(traces):
        arrived, absent = _inputs(evidence, trace)
        missing += absent
        newest.update({key: items[-1] for key, items in arrived.items()})
        for topic, message in service.step(Inbox(dict(newest), arrived), trace.now):
            sequence = sequences.setdefault(topic.key, 0)
            sequences[topic.key] += 1
            entry = recorded.get(topic.key, {}).get(sequence)
            _compare(result, topic, sequence, trace.now, entry, message, recorded)
        if watch and count % 20 == 0:
            watch(count / len(traces))
    result.steps = len(traces)
    if missing:
        result.notes.append(
            f"{missing} inputs of {service.name} are not in the file: the recorder was not "
            "there yet or too slow"
        )
    result.differences.extend(_unsaid(traces, recorded, sequences))
    result.differences.sort(key=lambda d: d.time)
    return result


def _inputs(evidence: Evidence, trace: Trace) -> tuple[dict[str, list[Received]], int]:
    arrived: dict[str, list[Received]] = defaultdict(list)
    absent = 0
    for item in trace.inputs:
        entry = evidence.inputs.get((item.topic, item.publisher, item.sequence))
        if entry is None:
            absent += 1
            continue
        arrived[item.topic].append(
            Received(entry.parse(), item.publisher, item.sequence, item.received)
        )
    return arrived, absent


def _compare(
    result: Retraced,
    topic: Topic,
    sequence: int,
    now: int,
    entry: Entry | None,
    message: Message,
    recorded: dict[str, dict[int, Entry]],
) -> None:
    payload = message.SerializeToString(deterministic=True)
    schema = topic.type.DESCRIPTOR.full_name
    time = entry.log_time if entry else now
    result.outputs.append(Entry(topic.key, schema, payload, result.session, sequence, time))
    if entry is None:
        # The last words of a service may still be under way when a recording ends, and what a
        # recorder was too slow for is missing from the numbers.
        if topic.key not in recorded:
            result.differences.append(Difference(topic.key, sequence, now, "", "nothing", schema))
        return
    result.compared[topic.key] += 1
    if payload == entry.payload:
        return
    for path, before, after, size in field_differences(topic, entry.parse(), message):
        result.differences.append(
            Difference(topic.key, sequence, entry.log_time, path, before, after, size)
        )


def _unsaid(
    traces: list[Trace], recorded: dict[str, dict[int, Entry]], sequences: dict[str, int]
) -> Iterator[Difference]:
    """Messages that stand in the recording and were not said again."""
    for key, outputs in recorded.items():
        for sequence, entry in outputs.items():
            # The trace of the step that sent it may be behind the end of the file.
            if sequence >= sequences[key] and entry.log_time <= traces[-1].now:
                yield Difference(key, sequence, entry.log_time, "", entry.schema, "nothing")


def _first(outputs: dict[int, Entry], traces: list[Trace]) -> int:
    """Number of the first message on a topic that the traced steps sent."""
    if traces[0].step == 0:
        return 0
    after = [s for s, entry in outputs.items() if entry.log_time >= traces[0].now]
    return min(after, default=0)


def _note_gaps(result: Retraced, traces: list[Trace], rate: float) -> None:
    first = traces[0].step
    if first:
        result.notes.append(
            f"the recording begins {first / rate:.1f} s after {result.service} did (step {first}): "
            "it is replayed from a fresh start, so what it remembered from before is missing"
        )
    lost = traces[-1].step - first + 1 - len(traces)
    if lost:
        result.notes.append(f"{lost} steps of {result.service} are missing in its trace")
