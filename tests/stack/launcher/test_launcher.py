"""Launcher: processes that die, freeze or outlive it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from lariat.scenario import load
from shared import topics
from shared.messages import ProcessState, StackRequest, StackState, TaskRequest
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live

RUNNING_TEXT = load("three-cylinders").text.partition("\n")[2]
"""Scenario of the first cell, without its first line, the name."""


class Stack:
    """A launcher with its processes, and the test's ear on it."""

    def __init__(self, cell: Cell, folder: Path, *names: str, terminal: int | None = None) -> None:
        self._output = folder / "output"
        launch = [sys.executable, "-m", "tests.stack.launch", str(cell.port), cell.namespace]
        with self._output.open("w") as output:
            self.process = subprocess.Popen(
                [*launch, *names],
                stdin=subprocess.PIPE,
                stdout=output if terminal is None else terminal,
                stderr=subprocess.STDOUT,
            )
        bus = cell("test")
        self.requests = bus.publisher(topics.TASK_REQUEST)
        self.stack_requests = bus.publisher(topics.STACK_REQUEST)
        self._state = bus.subscribe(topics.STACK_STATE)
        self.newest = StackState()
        self._health = bus.subscribe(topics.HEALTH)
        self.pids: dict[str, int] = {}
        self._processes: dict[str, ProcessState] = {}

    @property
    def output(self) -> str:
        return self._output.read_text()

    def state(self, name: str) -> ProcessState:
        """The newest that the launcher said of a process."""
        for _, item in self._state.take():
            self.newest = item.message
            self._processes = {p.service: p for p in item.message.processes}
        for _, item in self._health.take():
            self.pids[item.message.service] = item.message.process
        return self._processes.get(name, ProcessState())

    def until_ready(self, *names: str) -> None:
        until(lambda: all(self.state(n).state == "ready" and n in self.pids for n in names), 30.0)

    def until_gone(self, seconds: float) -> None:
        until(lambda: not any(_exists(pid) for pid in self.pids.values()), seconds)

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        if self.process.stdin:
            self.process.stdin.close()
        for pid in self.pids.values():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def _exists(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.fixture
def cell() -> Iterator[Cell]:
    with ExitStack() as stack:
        yield Cell(stack, hub=False)


@contextmanager
def started(cell: Cell, folder: Path) -> Iterator[Stack]:
    stack = Stack(cell, folder, "one", "two")
    try:
        stack.until_ready("one", "two")
        yield stack
    finally:
        stack.close()


@pytest.fixture
def stack(cell: Cell, tmp_path: Path) -> Iterator[Stack]:
    with started(cell, tmp_path) as stack:
        yield stack


@pytest.fixture(scope="module")
def lasting_stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Stack for the tests that leave it as it was."""
    with ExitStack() as cells, started(Cell(cells, hub=False), tmp_path_factory.mktemp("s")) as s:
        yield s


def test_ctrl_c_ends_all_in_order_and_says_so(stack: Stack) -> None:
    stack.process.send_signal(signal.SIGINT)
    assert stack.process.wait(timeout=10.0) == 0
    stack.until_gone(0.1)
    assert "all ready" in stack.output
    assert stack.output.count("closed in order") == 2
    assert "lariat | stopped in" in stack.output


def test_ctrl_z_does_not_suspend_the_launcher(lasting_stack: Stack) -> None:
    lasting_stack.process.send_signal(signal.SIGTSTP)
    until(lambda: "Ctrl-Z is refused" in lasting_stack.output)


def test_processes_have_their_priorities_once_all_are_ready(lasting_stack: Stack) -> None:
    pids = lasting_stack.pids.values()
    until(lambda: {os.getpriority(os.PRIO_PROCESS, pid) for pid in pids} == {3}, 5.0)


def test_a_killed_process_is_replaced_and_never_arms_by_itself(stack: Stack) -> None:
    assert "one | ready" in stack.output
    first = stack.pids["one"]
    os.kill(first, signal.SIGKILL)
    until(lambda: stack.state("one").state == "restarting")
    until(lambda: stack.state("one").state == "ready" and stack.pids["one"] != first)
    assert (stack.state("one").restarts, stack.state("one").exit_code) == (1, 128 + 9)
    assert stack.state("two").restarts == 0
    assert re.search(r"one \|.*SIGKILL.*restarting in 0\.25 s", stack.output)
    command = Path(f"/proc/{stack.pids['one']}/cmdline").read_bytes().split(b"\0")
    assert b"--restarted" in command


def test_three_deaths_end_the_stack_with_the_exit_code_of_the_last(stack: Stack) -> None:
    until(lambda: stack.requests.has_subscribers)
    for count in range(3):
        until(lambda n=count: stack.state("two").restarts == n, 20.0)
        stack.until_ready("two")
        os.kill(stack.pids["two"], signal.SIGKILL)
        until(lambda n=count: stack.state("two").restarts > n or n == 2, 20.0)
    assert stack.process.wait(timeout=10.0) == 128 + 9
    stack.until_gone(0.1)
    assert re.search(r"SIGKILL.*3 times.*giving up", stack.output)


def test_a_frozen_process_is_shown_and_so_is_its_return(lasting_stack: Stack) -> None:
    stack = lasting_stack
    os.kill(stack.pids["two"], signal.SIGSTOP)
    until(lambda: stack.state("two").state == "frozen", 5.0)
    assert "two | frozen" in stack.output
    os.kill(stack.pids["two"], signal.SIGCONT)
    until(lambda: stack.state("two").state == "ready")
    assert "two | answers again" in stack.output
    assert stack.state("two").restarts == 0


def test_a_frozen_process_does_not_outlive_ctrl_c(stack: Stack) -> None:
    os.kill(stack.pids["two"], signal.SIGSTOP)
    stack.process.send_signal(signal.SIGINT)
    assert stack.process.wait(timeout=10.0) == 0
    stack.until_gone(0.1)
    assert re.search(r"two \|.*killed", stack.output)


def test_process_that_saves_data_is_waited_for_within_ten_seconds(
    cell: Cell, tmp_path: Path
) -> None:
    stack = Stack(cell, tmp_path, "one:6", "two:30")
    try:
        stack.until_ready("one", "two")
        start = time.monotonic()
        stack.process.send_signal(signal.SIGHUP)
        until(lambda: "one | closed in order" in stack.output, 5.0)
        assert time.monotonic() - start > 2.5
        assert stack.process.wait(timeout=15.0) == 0
        assert time.monotonic() - start < 10.0
        assert {"one | 5 of", "two | 15 of"} <= set(re.findall(r"\w+ \| \d+ of", stack.output))
        assert stack.output.count("closed in order") == 1
        assert re.findall(r"(\w+) \|.*killed", stack.output) == ["two"]
    finally:
        stack.close()


def test_stack_whose_terminal_was_closed_ends_in_order(cell: Cell, tmp_path: Path) -> None:
    reader, terminal = os.openpty()
    stack = Stack(cell, tmp_path, "one:2", terminal=terminal)
    try:
        stack.until_ready("one")
        os.close(terminal)
        os.close(reader)
        start = time.monotonic()
        stack.process.send_signal(signal.SIGHUP)
        assert stack.process.wait(timeout=15.0) == 0
        # It has waited for what saves data, and no longer.
        assert 1.0 < time.monotonic() - start < 5.0
    finally:
        stack.close()


def test_a_killed_launcher_leaves_nothing_behind(stack: Stack) -> None:
    os.kill(stack.pids["two"], signal.SIGSTOP)
    stack.process.kill()
    stack.until_gone(2.0)


def test_an_error_of_its_own_ends_a_process_and_not_the_stack(stack: Stack) -> None:
    until(lambda: stack.requests.has_subscribers)
    stack.requests.put(TaskRequest(id="now", key="crash"))
    until(lambda: stack.state("one").restarts == stack.state("two").restarts == 1, 20.0)
    stack.until_ready("one", "two")
    assert "RuntimeError: asked to by now" in stack.output
    assert stack.state("one").exit_code == 70


def test_bad_input_of_a_service_ends_the_stack_at_once_with_2(cell: Cell, tmp_path: Path) -> None:
    stack = Stack(cell, tmp_path, "one", "two:refuse")
    try:
        assert stack.process.wait(timeout=20.0) == 2
        assert "two | beacon: rope.colour" in stack.output
        assert "restarting" not in stack.output
    finally:
        stack.close()


def start(stack: Stack, scenario: str, **fields: object) -> None:
    until(lambda: stack.stack_requests.has_subscribers)
    request = StackRequest(id="r", action=StackRequest.START, scenario=scenario, **fields)
    stack.stack_requests.put(request)


def test_another_scenario_takes_the_place_of_the_first(stack: Stack) -> None:
    former = [stack.pids["one"], stack.pids["two"]]
    start(stack, "rope")
    until(lambda: stack.state("rope").state == "ready", 20.0)
    until(lambda: stack.state("rope") and not stack.newest.activity)
    assert (stack.newest.scenario, stack.newest.refusal) == ("rope", "")
    assert [p.service for p in stack.newest.processes] == ["rope"]
    assert not any(_exists(pid) for pid in former)
    assert stack.output.count("closed in order") == 2
    stack.process.send_signal(signal.SIGINT)
    assert stack.process.wait(timeout=10.0) == 0


def test_former_scenario_returns_where_another_refuses(stack: Stack) -> None:
    start(stack, "", content=b'name = "refuse"\n' + RUNNING_TEXT.encode())
    until(lambda: stack.state("three-cylinders").state == "ready", 20.0)
    until(lambda: stack.state("three-cylinders") and stack.newest.refusal)
    assert re.search(r"refuse.*rope\.colour", stack.newest.refusal)
    assert stack.newest.scenario == "three-cylinders"
    assert stack.process.poll() is None


def test_scenario_whose_files_cannot_be_written_leaves_the_present_one_running(
    lasting_stack: Stack,
) -> None:
    stack = lasting_stack
    stack.state("one")
    former = dict(stack.pids)
    start(stack, "", content=b'name = "full"\n' + RUNNING_TEXT.encode())
    until(lambda: stack.state("one") and stack.newest.refusal, 20.0)
    expected = "no space left on device"
    assert stack.newest.refusal == expected
    assert stack.newest.scenario == "three-cylinders"
    assert stack.pids == former
    assert all(map(_exists, former.values()))


def test_processes_are_watched_while_a_request_is_answered(stack: Stack) -> None:
    until(lambda: stack.stack_requests.has_subscribers)
    save = StackRequest(id="slow", action=StackRequest.SAVE, name="slow")
    stack.stack_requests.put(save)
    os.kill(stack.pids["two"], signal.SIGKILL)
    until(lambda: stack.state("two").restarts == 1, 10.0)
    stack.until_ready("two")
    assert stack.newest.last_request == ""
    assert stack.process.stdin
    stack.process.stdin.close()
    until(lambda: stack.state("one") and stack.newest.last_request == "slow", 10.0)
    assert stack.newest.refusal == ""
    assert "slow" in [entry.name for entry in stack.newest.scenarios]
