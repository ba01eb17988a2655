"""Strict replay: each message that is not there exactly once is a difference, named by its number.

A source publishes on a `latest`, an `every` and two `joined` topics; an echo reads all of them. The
recording of both is edited message by message.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest

from lariat.scenario import parse
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import NodeChain, Plan, TaskRequest, TaskState, Trace, timestamp
from shared.recording import Entry, Recording, Writer
from shared.runtime.service import Inbox, Publication
from stack.replay.recorded_service import RecordedService
from stack.replay.trace_replay import ReplayResult, replay_start
from stack.simulation.simulated_time import START, Delivery, SimulatedStack
from tests.stack.small_cell import TEXT

COLOR = topics.CAMERA_COLOR.at("overhead")
DEPTH = topics.CAMERA_DEPTH.at("overhead")
READ = (topics.ROPE_NODES, topics.TASK_REQUEST, COLOR, DEPTH)
INPUT_KEYS = tuple(topic.key for topic in READ)


class Source:
    """Publishes one message on every topic that the echo reads."""

    name, reads, writes = "sim", (), READ
    rate, latency = 20.0, 0.01

    def warm_up(self) -> None: ...

    def step(self, inbox: Inbox, now: int):
        yield Publication(topics.ROPE_NODES, NodeChain(stamp=now, positions=[now / SECOND, 0, 0]))
        yield Publication(topics.TASK_REQUEST, TaskRequest(id=str(now), stamp=now))
        for topic in (COLOR, DEPTH):
            yield Publication(topic, topic.type(timestamp=timestamp(now)))


class Echo:
    """Publishes a state at every step and a plan for every new rope."""

    name, reads = "controller", READ
    writes = (topics.TASK_STATE, topics.CONTROLLER_PLAN)
    rate, latency = 20.0, 0.02

    def __init__(self, says: Callable[[int], int] = lambda step: 1) -> None:
        self._says = says
        """How often each step publishes its state."""
        self._steps = 0
        self._requests = 0

    def warm_up(self) -> None: ...

    def step(self, inbox: Inbox, now: int):
        self._requests += len(inbox.every(topics.TASK_REQUEST))
        images = inbox.joined(COLOR, DEPTH)
        state = TaskState(stamp=now, revision=self._requests, replan_count=int(images is not None))
        for _ in range(self._says(self._steps)):
            yield Publication(topics.TASK_STATE, state)
        if rope := inbox.fresh(topics.ROPE_NODES):
            yield Publication(topics.CONTROLLER_PLAN, Plan(stamp=rope.message.stamp))
        self._steps += 1


def record() -> list[Entry]:
    deliveries: list[Delivery] = []
    stack = SimulatedStack([Source(), Echo()], [deliveries.append])
    stack.advance_to(START + SECOND)
    return entries_of(deliveries)


def entries_of(deliveries: Iterable[Delivery]) -> list[Entry]:
    return [
        Entry(
            d.key,
            d.topic.type.DESCRIPTOR.full_name,
            d.payload,
            d.publisher,
            d.sequence,
            d.received,
        )
        for d in deliveries
    ]


def write(path: Path, entries: Iterable[Entry], time: str = "simulated") -> Path:
    ordered = sorted(entries, key=lambda e: e.log_time)
    if time == "live":
        # A live service sends its outputs at once, before its trace.
        latency = {"lariat.Trace": 0}
        ordered = sorted(
            (
                replace(e, log_time=e.log_time - latency.get(e.schema, 20_000_000))
                if e.publisher == "controller-0"
                else e
                for e in entries
            ),
            key=lambda e: (e.log_time, e.schema == "lariat.Trace"),
        )
    writer = Writer(path, parse(TEXT, path.parent), ordered[0].log_time, {"time": time})
    for e in ordered:
        writer.write(e.topic, e.payload, e.publisher, e.sequence, e.log_time)
    writer.close()
    return path


def replayed(path: Path, echo: Echo | None = None) -> ReplayResult:
    recorded = RecordedService(Recording.open(path), "controller")
    return replay_start(recorded, echo or Echo(), "controller-0")


def kinds(result: ReplayResult) -> set[tuple[str, str, int]]:
    return {(d.kind, d.topic, d.sequence) for d in result.differences}


@pytest.fixture(params=["simulated", "live"])
def time(request: pytest.FixtureRequest) -> str:
    return request.param


def test_the_untouched_recording_replays_the_same(tmp_path: Path, time: str):
    result = replayed(write(tmp_path / "a.mcap", record(), time))
    assert result.same
    assert result.notes == []
    assert result.compared == {"task/state": 20, "controller/plan": 19}


def test_one_message_more_than_recorded_is_a_difference(tmp_path: Path, time: str):
    path = write(tmp_path / "a.mcap", record(), time)
    result = replayed(path, Echo(lambda step: 2 if step == 7 else 1))
    extra = [d for d in result.differences if d.kind == "extra"]
    assert [d.topic for d in extra] == ["task/state"]
    if time == "simulated":
        # Simulated time tells the step: none of the later messages differs.
        assert kinds(result) == {("extra", "task/state", 8)}
        assert extra[0].time == START + 7 * SECOND // 20


def test_a_message_that_is_not_published_is_a_difference(tmp_path: Path, time: str):
    path = write(tmp_path / "a.mcap", record(), time)
    result = replayed(path, Echo(lambda step: 0 if step == 7 else 1))
    lacking = [d for d in result.differences if d.kind == "lacks"]
    assert [d.topic for d in lacking] == ["task/state"]
    if time == "simulated":
        assert kinds(result) == {("lacks", "task/state", 7)}
        assert lacking[0].time == START + 7 * SECOND // 20 + 20_000_000


def test_an_output_that_the_file_lacks_is_a_difference(tmp_path: Path):
    entries = [e for e in record() if (e.key, e.sequence) != ("controller/plan", 5)]
    result = replayed(write(tmp_path / "a.mcap", entries))
    assert kinds(result) == {("extra", "controller/plan", 5)}


@pytest.mark.parametrize("key", INPUT_KEYS)
def test_an_input_that_the_file_lacks_is_a_difference(tmp_path: Path, key: str, time: str):
    entries = [e for e in record() if (e.key, e.sequence) != (key, 5)]
    result = replayed(write(tmp_path / "a.mcap", entries, time))
    (absent,) = [d for d in result.differences if d.kind == "absent"]
    assert (absent.topic, absent.sequence) == (key, 5)
    assert absent.time == START + 5 * SECOND // 20 + 10_000_000
    assert result.notes == []


@pytest.mark.parametrize("key", [*INPUT_KEYS, "task/state", "controller/plan"])
def test_a_doubled_input_or_output_is_a_difference(tmp_path: Path, key: str, time: str):
    entries = record()
    (twice,) = [e for e in entries if (e.key, e.sequence) == (key, 5)]
    result = replayed(write(tmp_path / "a.mcap", [*entries, twice], time))
    assert kinds(result) == {("doubled", key, 5)}


def test_an_input_that_two_steps_take_is_a_difference(tmp_path: Path):
    entries = record()
    place, trace = next(
        (k, Trace.FromString(e.payload))
        for k, e in enumerate(entries)
        if e.key == "trace/controller" and e.sequence == 8
    )
    trace.inputs.extend(
        i
        for e in entries
        if e.key == "trace/controller" and e.sequence == 7
        for i in Trace.FromString(e.payload).inputs
        if i.topic == "task/request"
    )
    entries[place] = replace(entries[place], payload=trace.SerializeToString())
    result = replayed(write(tmp_path / "a.mcap", entries))
    assert ("doubled", "task/request", 6) in kinds(result)


def test_a_step_without_a_trace_is_a_difference(tmp_path: Path, time: str):
    entries = [e for e in record() if (e.key, e.sequence) != ("trace/controller", 9)]
    result = replayed(write(tmp_path / "a.mcap", entries, time))
    assert ("lost step", "trace/controller", 9) in kinds(result)


def test_a_trace_that_stands_twice_is_a_difference(tmp_path: Path):
    entries = record()
    (twice,) = [e for e in entries if (e.key, e.sequence) == ("trace/controller", 9)]
    result = replayed(write(tmp_path / "a.mcap", [*entries, twice]))
    assert kinds(result) == {("doubled", "trace/controller", 9)}


def test_messages_under_way_at_the_end_are_named_and_no_difference(tmp_path: Path):
    end = START + SECOND // 2
    entries = [e for e in record() if e.log_time <= end]
    result = replayed(write(tmp_path / "a.mcap", entries))
    assert result.same
    for note, key in zip(result.ends, ("controller/plan", "task/state"), strict=True):
        assert note.startswith(f"1 messages on {key} ")
    # One nanosecond later the same messages should be in the file.
    later = replace(entries[0], key="rope/truth", log_time=end + 20_000_000, sequence=99)
    result = replayed(write(tmp_path / "b.mcap", [*entries, later]))
    assert {d.kind for d in result.differences} == {"extra"}


def test_a_file_that_begins_late_says_so_and_names_its_first_inputs(tmp_path: Path, time: str):
    begin = START + SECOND // 2 + 5_000_000
    entries = [e for e in record() if e.log_time >= begin]
    result = replayed(write(tmp_path / "a.mcap", entries, time))
    assert re.search(r"0\.6 s.*controller.*step 11", result.notes[0])
    assert not {d.kind for d in result.differences} & {"absent", "lacks", "extra", "lost step"}
    if time == "simulated":
        first = next(i for e in entries if e.key == "trace/controller" for i in e.parse().inputs)
        # Received before the file begins, or not: that alone decides.
        late = [replace(e, log_time=first.received - 1) for e in entries[:1]]
        kept = [e for e in entries if (e.key, e.sequence) != (first.topic, first.sequence)]
        result = replayed(write(tmp_path / "b.mcap", [*late, *kept[1:]], time))
        assert "absent" in {d.kind for d in result.differences}


def test_a_number_that_a_live_recorder_missed_is_noted_by_its_gap(tmp_path: Path):
    entries = [e for e in record() if (e.key, e.sequence) != ("controller/plan", 5)]
    result = replayed(write(tmp_path / "a.mcap", entries, "live"))
    assert result.same
    (note,) = result.notes
    assert note.startswith("1 messages on controller/plan ")


def test_a_cut_live_file_ends_with_messages_of_untraced_steps(tmp_path: Path):
    entries = record()
    last = max(k for k, e in enumerate(entries) if e.key == "trace/controller")
    kept = [e for k, e in enumerate(entries) if k != last]
    result = replayed(write(tmp_path / "a.mcap", kept, "live"))
    assert result.same


@pytest.mark.parametrize(("shift", "same"), [(2e-8, True), (1e-6, False)])
def test_a_small_shift_of_every_chain_is_found_by_the_median(
    tmp_path: Path, shift: float, same: bool
):
    class Rope(Echo):
        """Publishes a chain of its own at every step."""

        writes = (topics.ROPE_NODES,)

        def __init__(self, offset: float) -> None:
            self._offset = offset

        def step(self, inbox: Inbox, now: int):
            x = now / SECOND + self._offset
            yield Publication(topics.ROPE_NODES, NodeChain(stamp=now, positions=[x, 0, 0]))

    deliveries: list[Delivery] = []
    SimulatedStack([Rope(0.0)], [deliveries.append]).advance_to(START + SECOND)
    result = replayed(write(tmp_path / "a.mcap", entries_of(deliveries)), Rope(shift))
    assert result.same == same
    assert {d.kind for d in result.differences} <= {"median"}
