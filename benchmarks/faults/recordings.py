"""End of a recording when its stack is stopped or killed: `lariat bench faults recordings`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.child_processes import child_processes
from benchmarks.live_stack import LiveStack
from benchmarks.operator import POLL_PERIOD, Operator
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.configuration import ConfigurationError
from lariat.scenario.shipped import find
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import RUNNING, TaskRequest
from shared.recording import Recording

DEFAULT_SCENARIO = Path("three-cylinders")
"""Scenario whose camera makes nine tenths of a recording."""
STOPS = {"Ctrl-C": signal.SIGINT, "SIGTERM": signal.SIGTERM, "SIGHUP": signal.SIGHUP}
"""Signals to the launcher by the name of the case, after which nothing may be lost."""
RECORDER_KILLED, STACK_KILLED = "kill -9 of the recorder", "kill -9 of all"
"""Cases that may lose `MAX_LOSS`."""
CASES = (*STOPS, RECORDER_KILLED, STACK_KILLED)
"""Names of all cases."""
MAX_LOSS = 1.0
"""Longest time of a recording that a kill may take [s]."""
STOP_TIME = 10.0
"""Longest time until all processes have ended after a stop [s]."""
START_TIMEOUT, END_TIMEOUT = 30.0, 15.0
"""Longest wait for the run to begin, and for the launcher to end [s]."""


def run(
    cases: tuple[str, ...] = CASES,
    scenario: Path = DEFAULT_SCENARIO,
    seconds: float = 2.0,
    loops: int = 2,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Stop and kill a live stack in a run, and see how much of the recording is missing.

    Busy loops of usual priority run beside it, each in a session of its own.

    Args:
        cases: Names of the cases, as in the first column.
        scenario: A scenario's TOML file, or the short name of a shipped one.
        seconds: Duration of the run until the signal [s].
        loops: Number of busy loops.

    Returns:
        0 when no more was lost than docs/guide/recordings.md says, 1 otherwise.
    """
    for name in cases:
        if name not in CASES:
            raise ConfigurationError(f"no case {name!r}; expected one of {', '.join(CASES)}")
    ends = []
    for name in cases:
        with LiveStack(find(scenario)) as stack, busy_loops(loops):
            ends.append(_end_of(stack, name, seconds))
    options.publish(Result("recordings", ends, f"{loops} busy loops, {os.cpu_count()} cores"))
    return 0 if ends and all(end["ok"] for end in ends) else 1


@contextmanager
def busy_loops(count: int) -> Iterator[None]:
    """Keep processor cores busy for the duration of a `with` block."""
    command = [sys.executable, "-S", "-c", "while True: pass"]
    loops = [subprocess.Popen(command, start_new_session=True) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def _end_of(stack: LiveStack, case: str, seconds: float) -> dict[str, Any]:
    """Stop or kill a stack in a run; return what is recorded of it, and what is lost.

    The loss is the time from the last recorded state of the arms to the last one that a second
    listener had heard when the signal was sent. A run of which nothing is recorded proves nothing.
    """
    with stack.connect() as client:
        operator = Operator(client)
        running = lambda: operator.task.state == RUNNING  # noqa: E731
        client.request_task(TaskRequest.START)
        operator.wait_until(running, START_TIMEOUT, "no run begins", goes_on=True)
        time.sleep(seconds)
        operator.wait_until(running, START_TIMEOUT, "the run is over", goes_on=True)
        heard, files, begun = operator.arms.stamp, _files(stack), time.monotonic()
    _end(stack, case)
    if case != RECORDER_KILLED:
        while not stack.has_ended and time.monotonic() - begun < END_TIMEOUT:
            time.sleep(POLL_PERIOD)
        files = _files(stack)
    ended = time.monotonic() - begun
    recorded, last, images = _content(files)
    lost = max(0.0, (heard - last) / SECOND)
    in_time = lost == 0.0 and ended <= STOP_TIME if case in STOPS else lost <= MAX_LOSS
    return {
        "case": case,
        "recorded_s": round(recorded, 1),
        "lost_s": round(lost, 2),
        "ended_s": round(ended, 1),
        "images": images,
        "ok": in_time and recorded > 0.0,
    }


def _end(stack: LiveStack, case: str) -> None:
    if case in STOPS:
        os.kill(stack.pid, STOPS[case])
        return
    for pid, name in child_processes(stack.pid).items():
        if name == "recorder" or case == STACK_KILLED:
            os.kill(pid, signal.SIGKILL)
    if case == STACK_KILLED:
        os.kill(stack.pid, signal.SIGKILL)


def _files(stack: LiveStack) -> list[Path]:
    return sorted((stack.folder / "recordings").glob("*.mcap"))


def _content(files: list[Path]) -> tuple[float, int, int]:
    """Time of the run [s], stamp of the last state of the arms [ns], number of images."""
    running: list[int] = []
    last = images = 0
    for file in files:
        for entry in Recording(file).messages():
            if entry.key == topics.TASK_STATE.key and entry.parse().state == RUNNING:
                running.append(entry.publish_time)
            elif entry.key == topics.ARM_STATE.key:
                last = max(last, entry.parse().stamp)
            images += topics.CAMERA_COLOR.matches(entry.key)
    recorded = (max(running) - min(running)) / SECOND if running else 0.0
    return recorded, last, images
