"""Steps a service again through the inputs that its trace names, and compares its outputs.

Every step must publish exactly the recorded messages. Four facts of a recording are no differences
and are reported as its ends: a file that begins later than the service did, inputs that were sent
before it began, messages that were still under way when it ended, and messages of steps whose
trace lies behind the end. All four follow from step times, latencies and sequence numbers.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from shared import topics
from shared.messages import Trace
from shared.recording import Entry
from shared.runtime.service import Inbox, Received, Service
from stack.replay.alignment import Alignment, Pair, aligned, of_no_step
from stack.replay.comparison import Difference, field_differences, largest_differences
from stack.replay.recorded_service import RecordedService, TracedStep


@dataclass
class ReplayResult:
    """One start of a service, stepped again."""

    service: str
    session: str
    """Id of that start."""
    steps: int = 0
    compared: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    """Number of recorded messages by topic that were published again."""
    differences: list[Difference] = field(default_factory=list)
    """In the order of their times."""
    notes: list[str] = field(default_factory=list)
    """Why the replay cannot be faithful: where the recording begins too late."""
    ends: list[str] = field(default_factory=list)
    """Messages that were under way when the recording ended."""
    sizes: dict[tuple[str, str], list[float]] = field(default_factory=lambda: defaultdict(list))
    """Largest difference in each message, by topic and field with a median tolerance."""
    outputs: list[Entry] = field(default_factory=list)
    """Published messages with the numbers and log times of the recording."""
    step_times: list[float] = field(default_factory=list)
    """Processor time of each step, of all threads of this process [s]."""

    @property
    def same(self) -> bool:
        """Whether every message is the recorded one."""
        return not self.differences

    def step_time(self, percentile: float) -> float:
        """Percentile of the steps' processor time [ms]."""
        return 1e3 * float(np.percentile(self.step_times, percentile))


def replay_start(
    recorded: RecordedService,
    service: Service,
    session: str,
    watch: Callable[[float], None] | None = None,
    feed: Callable[[TracedStep], None] | None = None,
) -> ReplayResult:
    """Step a fresh service as one of its recorded starts was stepped."""
    start = recorded.starts[session]
    result = ReplayResult(service.name, session, steps=len(start.steps))
    result.differences.extend(start.flaws)
    alignment = aligned(recorded, start, service)
    newest: dict[str, Received] = {}
    predating = outlasting = 0
    for count, step in enumerate(start.steps):
        arrived, absent = _inputs(recorded, step.trace)
        newest.update({key: items[-1] for key, items in arrived.items()})
        for difference, before, after in absent:
            predating += before
            outlasting += after
            if not (before or after):
                result.differences.append(difference)
        if feed:
            feed(step)
        inbox = Inbox(dict(newest), arrived)
        begin = time.process_time()
        published = list(service.step(inbox, step.trace.now))
        result.step_times.append(time.process_time() - begin)
        for pair in alignment.step(step, published):
            _compare(result, pair, step.trace.now)
        if watch and count % 20 == 0:
            watch(count / len(start.steps))
    result.differences.extend(alignment.unclaimed())
    result.differences.extend(_medians(result, start.steps[-1].trace.now))
    result.differences.sort(key=lambda d: d.time)
    _note_beginning(result, start.steps[0].trace, service.rate, predating)
    _note_end(result, alignment, outlasting)
    return result


def _inputs(
    recorded: RecordedService, trace: Trace
) -> tuple[dict[str, list[Received]], list[tuple[Difference, bool, bool]]]:
    """Inputs of a step by topic, and those that the file lacks: difference, predates, outlasts."""
    arrived: dict[str, list[Received]] = defaultdict(list)
    absent = []
    for item in trace.inputs:
        entry = recorded.inputs.get((item.topic, item.publisher, item.sequence))
        if entry is None and not topics.find(item.topic).recorded:
            continue
        if entry is None:
            text = f"input of step {trace.step}"
            difference = Difference(
                item.topic, item.sequence, item.received, "", text, "not in the file", kind="absent"
            )
            absent.append((difference, recorded.predates(item), recorded.outlasts(item)))
            continue
        arrived[item.topic].append(
            Received(entry.parse(), item.publisher, item.sequence, item.received)
        )
    return arrived, absent


def _compare(result: ReplayResult, pair: Pair, now: int) -> None:
    """Compare one published message with the recorded one, or report that one of them lacks."""
    entry = pair.recorded
    if pair.published is None:
        assert entry is not None
        result.differences.append(of_no_step(entry))
        return
    topic, message = pair.published
    schema = topic.type.DESCRIPTOR.full_name
    payload = message.SerializeToString(deterministic=True)
    time = entry.log_time if entry else now
    result.outputs.append(Entry(topic.key, schema, payload, result.session, pair.sequence, time))
    if entry is None:
        if not pair.unrecorded:
            result.differences.append(
                Difference(topic.key, pair.sequence, now, "", "nothing", schema, kind="extra")
            )
        return
    result.compared[topic.key] += 1
    if payload == entry.payload:
        for name in topic.median_tolerance:
            result.sizes[topic.key, name].append(0.0)
        return
    for name, size in largest_differences(topic, entry.parse(), message).items():
        result.sizes[topic.key, name].append(size)
    for path, before, after, size in field_differences(topic, entry.parse(), message):
        result.differences.append(
            Difference(topic.key, entry.sequence, entry.log_time, path, before, after, size)
        )


def _medians(result: ReplayResult, now: int) -> Iterator[Difference]:
    """Fields that differ little in each message, but in most of them."""
    for (key, name), sizes in result.sizes.items():
        median, allowed = float(np.median(sizes)), topics.find(key).median_tolerance[name]
        if median > allowed:
            yield Difference(
                key, 0, now, name, f"median {allowed:g}", f"{median:.3g}", median, kind="median"
            )


def _note_beginning(result: ReplayResult, first: Trace, rate: float, predating: int) -> None:
    if first.step:
        result.notes.append(
            f"the recording begins {first.step / rate:.1f} s after {result.service} did "
            f"(step {first.step}): it is replayed from a fresh start, without its earlier state"
        )
    if predating:
        result.notes.append(
            f"{predating} inputs of {result.service} were sent before the recording began"
        )


def _note_end(result: ReplayResult, alignment: Alignment, outlasting: int) -> None:
    for key, count in sorted(alignment.under_way.items()):
        result.ends.append(f"{count} messages on {key} were under way when the recording ended")
    for key, count in sorted(alignment.untraced.items()):
        result.ends.append(f"{count} messages on {key} are of steps behind the recording's end")
    for key, count in sorted(alignment.unheard.items()):
        result.notes.append(f"{count} messages on {key} are missing in the recording's numbers")
    if outlasting:
        result.ends.append(f"{outlasting} inputs were not yet written when the recording ended")
