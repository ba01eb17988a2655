"""A real process on a real bus."""

from __future__ import annotations

import logging
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, nullcontext
from pathlib import Path

import pytest

from lariat.scenario.shipped import shipped_names
from shared import topics
from shared.bus import Bus
from shared.messages import Health, TaskRequest
from shared.runtime import live
from shared.runtime.clock import SystemClock
from shared.runtime.service import Inbox, Publication
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live

MODULE = "tests.shared.beacon"


class Beacon:
    """The test's service in a process of its own, and the test's ear on it."""

    def __init__(self, cell: Cell, *more: str) -> None:
        self.bus: Bus = cell("test")
        self.health = self.bus.subscribe(topics.HEALTH)
        self.traces = self.bus.subscribe(topics.TRACE.at("beacon"))
        self.states = self.bus.subscribe(topics.TASK_STATE)
        self.log = self.bus.subscribe(topics.LOG)
        self._requests = self.bus.publisher(topics.TASK_REQUEST)
        self.process = cell.spawn(MODULE, *more)
        until(lambda: self._requests.has_subscribers, 30.0)

    def ask(self, key: str, value: str = "") -> None:
        self._requests.put(TaskRequest(id=f"please-{key}", key=key, value=value))

    def reports(self, count: int) -> list[Health]:
        items: list[Health] = []
        until(lambda: items.extend(i.message for _, i in self.health.take()) or len(items) >= count)
        return items

    def end(self, number: signal.Signals = signal.SIGTERM) -> tuple[int, float, str]:
        """Exit code, seconds that it took, and everything that was printed."""
        start = time.monotonic()
        self.process.send_signal(number)
        output, _ = self.process.communicate(timeout=20.0)
        return self.process.returncode, time.monotonic() - start, output


@pytest.fixture
def cell() -> Iterator[Cell]:
    with ExitStack() as stack:
        yield Cell(stack)


def test_a_service_keeps_its_rate_traces_every_step_and_ends_in_order(cell: Cell) -> None:
    beacon = Beacon(cell)
    first = beacon.reports(1)[0]
    assert first.process == beacon.process.pid
    assert first.note == "arms by itself: True"
    beacon.ask("hello")
    answers = []
    until(
        lambda: (
            answers.extend(i.message for _, i in beacon.states.take() if i.message.last_request)
            or answers
        )
    )
    assert answers[0].last_request == "please-hello"
    assert answers[0].run == first.boot
    reports = beacon.reports(3)
    assert reports[-1].longest_step_ms == 300.0
    seconds = 1e-9 * (reports[-1].stamp - reports[0].stamp)
    # No rate above what was asked for, whatever was late; half of it on the busiest machine.
    rate = (reports[-1].steps - reports[0].steps) / seconds
    assert 50.0 < rate < 102.0
    assert "task/request" in reports[-1].input_age_ms
    code, took, output = beacon.end()
    assert code == 0
    assert took < 10.0
    assert "ready" in output
    assert output.endswith("closed in order\nstopped\n")


def test_a_message_that_wakes_a_service_does_not_wait_for_the_schedule(cell: Cell) -> None:
    beacon = Beacon(cell, "--woken")
    beacon.reports(1)
    for key in ("first", "second", "third"):
        beacon.ask(key)
        answers: list[str] = []

        def answered(answers: list[str] = answers) -> bool:
            answers.extend(i.message.last_request for _, i in beacon.states.take())
            return bool(answers)

        until(answered, 5.0)
        assert answers == [f"please-{key}"]


def test_a_trace_names_what_a_step_consumed(cell: Cell) -> None:
    beacon = Beacon(cell)
    beacon.reports(1)
    beacon.ask("hello")
    found = []

    def traced() -> bool:
        found.extend(i.message for _, i in beacon.traces.take() if i.message.inputs)
        return bool(found)

    until(traced)
    (given,) = found[0].inputs
    assert (given.topic, given.publisher, given.sequence) == ("task/request", "test", 0)
    assert found[0].service == "beacon"
    assert 0 <= found[0].now - given.received < 1e9
    beacon.end()


def test_a_late_step_counts_as_an_overrun_and_missed_steps_are_skipped(cell: Cell) -> None:
    beacon = Beacon(cell)
    before = beacon.reports(1)[0]
    beacon.ask("linger", "0.7")
    late: list[Health] = []
    until(lambda: late.extend(r for r in beacon.reports(1) if r.overruns > before.overruns) or late)
    assert late[0].step_max_ms > 700.0
    seconds = 1e-9 * (late[0].stamp - before.stamp)
    assert late[0].steps - before.steps < 100.0 * (seconds - 0.65)
    beacon.end()


def test_a_signal_ends_even_a_long_step_at_once(cell: Cell) -> None:
    beacon = Beacon(cell)
    beacon.reports(1)
    beacon.ask("linger", "30")
    time.sleep(0.5)
    code, took, _ = beacon.end(signal.SIGINT)
    assert code == 0
    assert took < 10.0


def test_a_signal_before_the_first_step_closes_the_service(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Closing:
        name, reads, writes, rate, latency = "beacon", (), (), 10.0, 0.0
        closed = False

        def warm_up(self) -> None:
            pass

        def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
            yield from ()

        def close(self) -> None:
            self.closed = True

    def stop() -> None:
        raise live.Stopped

    monkeypatch.setattr(live, "reserve_memory", stop)
    service, before = Closing(), list(logging.getLogger().handlers)
    with pytest.raises(live.Stopped):
        live.run(service, cell("beacon"), SystemClock(), "beacon-0")
    assert service.closed
    assert logging.getLogger().handlers == before


def test_an_error_in_a_step_is_logged_and_ends_the_process_with_70(cell: Cell) -> None:
    beacon = Beacon(cell)
    beacon.reports(1)
    beacon.ask("crash")
    output, _ = beacon.process.communicate(timeout=10.0)
    assert beacon.process.returncode == 70
    assert "RuntimeError: asked to by please-crash" in output
    words = [i.message.message for _, i in beacon.log.take()]
    assert any("RuntimeError: asked to by please-crash" in w for w in words)


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("--build", "refuse"), 2, "beacon: rope.colour = 'mauve' is not one of 'red'\n"),
        (("--build", "compiler"), 2, "beacon: Taichi is not installed\n"),
        (
            ("--build", "library"),
            2,
            "beacon: mujoco is not installed; run in the clone: pip install -e '.[all]'\n",
        ),
        (
            ("--scenario", "none.toml"),
            2,
            "beacon: cannot read scenario none.toml: no such file; shipped scenarios: "
            f"{', '.join(shipped_names())}\n",
        ),
    ],
)
def test_bad_input_is_reported_in_one_line(
    arguments: tuple[str, ...], code: int, said: str
) -> None:
    answer = subprocess.run(
        [sys.executable, "-m", MODULE, *arguments], capture_output=True, text=True, timeout=30.0
    )
    assert answer.stderr == said
    assert answer.returncode == code


def test_an_unexpected_exception_is_reported_with_its_traceback() -> None:
    answer = subprocess.run(
        [sys.executable, "-m", MODULE, "--build", "crash"],
        capture_output=True,
        text=True,
        timeout=30.0,
    )
    assert answer.returncode == 70
    assert "RuntimeError: unexpected" in answer.stderr


def test_a_restarted_service_does_not_arm_automatically(cell: Cell) -> None:
    beacon = Beacon(cell, "--restarted")
    assert beacon.reports(1)[0].note == "arms by itself: False"
    beacon.end()


def test_services_are_imported_by_the_modules_that_run_them() -> None:
    """Every service has its `python -m`, and it names its own package."""
    root = Path(live.__file__).parents[2]
    for file in sorted((root / "services").glob("*/service.py")):
        text = (file.parent / "__main__.py").read_text()
        assert f'main("services.{file.parent.name}"' in text


def test_a_step_that_does_not_end_is_reported_with_its_place(cell: Cell) -> None:
    beacon = Beacon(cell)
    beacon.reports(1)
    beacon.ask("linger", "2.0")
    notes: list[str] = []
    until(
        lambda: (
            notes.extend(r.note for r in beacon.reports(1) if "has not ended" in r.note) or notes
        )
    )
    assert "step" in notes[0]
    assert " 1." in notes[0]
    assert "step (service.py:" in notes[0]
    lines = [item.message.message for _, item in beacon.log.take()]
    assert notes[0] in lines
    _, _, output = beacon.end()
    assert notes[0] in output


def test_a_signal_waits_for_the_end_of_what_must_not_be_interrupted() -> None:
    done: list[str] = []

    def run(waits: bool) -> None:
        with live.stopping_on_signals() as stop:
            with stop.waiting() if waits else nullcontext():
                signal.raise_signal(signal.SIGTERM)
                done.append("end of the step")
            done.append("next step")

    with pytest.raises(live.Stopped):
        run(waits=False)
    assert done == []
    with pytest.raises(live.Stopped):
        run(waits=True)
    assert done == ["end of the step"]
