"""Fork server: a process that it forks is as one that was started as a program of its own."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from stack.launcher.fork_server import ForkServer
from stack.launcher.process import Process, Program, process_environment
from tests.shared.cell import until

pytestmark = pytest.mark.live

PROBE = "tests.stack.launcher.probe"


@pytest.fixture
def started(fork_server: ForkServer) -> Iterator[Process]:
    process = start(fork_server, "wait", "two words")
    yield process
    process.send(signal.SIGKILL)
    until(lambda: not process.running, 5.0)
    process.close()


def start(server: ForkServer | None, *arguments: str) -> Process:
    process = Process(Program("probe", PROBE, arguments), server)
    process.start()
    return process


def printed(process: Process) -> list[str]:
    lines: list[str] = []
    until(lambda: lines.extend(process.lines()) or "to standard error" in lines, 30.0)
    return lines


def facts(process: Process) -> dict[str, Any]:
    return json.loads(printed(process)[0])


def command_line(pid: int) -> list[str]:
    text = Path(f"/proc/{pid}/cmdline").read_bytes().rstrip(b"\0").decode()
    return text.split("\0")


def test_it_has_imported_what_all_share_and_nothing_runs_in_it(started: Process) -> None:
    seen = facts(started)
    assert seen["imported"]
    assert seen["threads"] == 1
    assert seen["files"] == [0, 1, 2]
    assert seen["input"] == "/dev/null"


def test_it_is_a_child_of_the_launcher_in_a_session_of_its_own(started: Process) -> None:
    seen = facts(started)
    assert (seen["parent"], seen["session"]) == (os.getpid(), started.pid)


def test_it_shows_the_command_line_of_a_program_of_its_own(started: Process) -> None:
    plain = start(None, "wait", "two words")
    try:
        seen, expected = facts(started), facts(plain)
        assert seen["argv"] == expected["argv"] == ["wait", "two words"]
        assert seen["main"] == expected["main"]
        assert seen["unbuffered"] == expected["unbuffered"]
        assert command_line(started.pid) == command_line(plain.pid)
    finally:
        plain.send(signal.SIGKILL)
        until(lambda: not plain.running, 5.0)
        plain.close()


def test_processes_share_no_randomness(fork_server: ForkServer) -> None:
    drawn = [facts(start(fork_server, "code"))["random"] for _ in range(2)]
    assert not set(drawn[0]) & set(drawn[1])


@pytest.mark.parametrize(("way", "code"), [("code", 3), ("error", 1), ("none", 0)])
def test_its_exit_code_is_that_of_the_program(fork_server: ForkServer, way: str, code: int) -> None:
    process = start(fork_server, way)
    until(lambda: process.poll() is not None, 10.0)
    assert process.exit_code == code
    assert ("RuntimeError: asked to" in printed(process)) == (way == "error")


def test_the_signal_that_ends_it_is_known(started: Process) -> None:
    printed(started)
    os.kill(started.pid, signal.SIGTERM)
    until(lambda: started.poll() is not None, 5.0)
    assert started.exit_code == 128 + signal.SIGTERM


def test_it_outlives_the_fork_server_and_later_ones_are_programs_of_their_own() -> None:
    with ForkServer(process_environment()) as server:
        first = start(server, "wait")
        printed(first)
        assert server._server is not None
        server._server.kill()
        second = start(server, "wait")
        try:
            assert first.running
            seen = facts(second)
            assert not seen["imported"]
            assert (seen["parent"], seen["session"]) == (os.getpid(), second.pid)
        finally:
            for process in (first, second):
                process.send(signal.SIGKILL)
                until(lambda p=process: not p.running, 5.0)
                process.close()


def test_it_does_not_run_for_a_launcher_that_has_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fork server that hangs: what it forks later must not run beside what took its place."""
    monkeypatch.setattr("stack.launcher.fork_server.ANSWER_TIMEOUT", 0.5)
    with ForkServer(process_environment()) as server:
        assert server._server is not None
        os.kill(server._server.pid, signal.SIGSTOP)
        process = start(server, "wait")
        try:
            assert not facts(process)["imported"]
        finally:
            process.send(signal.SIGKILL)
            until(lambda: not process.running, 5.0)
            process.close()
