from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from stack.launcher.fork_server import ForkServer
from stack.launcher.process import RESTART_NICENESS, Process, Program
from tests.shared.cell import until

pytestmark = pytest.mark.live

NICENESS = 7


@pytest.mark.parametrize("forked", [True, False])
@pytest.mark.parametrize("restarts", [0, 1])
def test_a_process_takes_its_priority_once_the_stack_has_started(
    restarts: int, forked: bool, fork_server: ForkServer
) -> None:
    """One that is started again, in a cell that may move, starts before those that only draw."""
    arguments = ("--connect", "tcp/127.0.0.1:9")
    program = Program("one", "tests.shared.beacon", arguments, niceness=NICENESS)
    process = Process(program, fork_server if forked else None)
    process.restarts = restarts
    process.start()

    def niceness() -> set[int]:
        threads = Path(f"/proc/{process.pid}/task").iterdir()
        return {os.getpriority(os.PRIO_PROCESS, int(thread.name)) for thread in threads}

    try:
        lines: list[str] = []
        until(lambda: lines.extend(process.lines()) or "ready" in lines, 30.0)
        assert niceness() == {RESTART_NICENESS if restarts else 0}
        # A thread that is born in that instant may miss it.
        until(lambda: process.prioritize() or niceness() == {NICENESS}, 5.0)
    finally:
        process.send(signal.SIGKILL)
        until(lambda: not process.running, 5.0)
        process.close()
