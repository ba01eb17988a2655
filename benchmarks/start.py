"""Processor time of a stack's start: `lariat bench start`.

`lariat up` starts a scenario, and the kernel states the processor time of each process when all are
ready. It hardly depends on what else the machine does, unlike the time until then.
"""

from __future__ import annotations

import json as encoder
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.table import Table

from benchmarks.live_stack import LiveStack
from benchmarks.result_block import find_block, show
from shared.scenario import find

TICK = 1.0 / os.sysconf("SC_CLK_TCK")
"""Unit of the kernel's processor times [s]."""
LAUNCHER = "lariat up"
"""Name of the launcher."""
CHECK = "check of the scenario"
"""Name of the process that checks the scenario before the others start."""


def run(
    scenario: Path = Path("three-cylinders"),
    count: int = 3,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Start a stack several times and measure the processor time of each process.

    One start that is not counted comes first: it compiles kernels that are not kept yet.

    Examples:
      lariat bench start
      lariat bench start --scenario two-arms --count 5

    Args:
        scenario: A scenario's TOML file, or the short name of a shipped one.
        count: Number of starts.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.
    """
    block = find_block(docs)
    path = find(scenario)
    starts = [processor_times(path) for _ in range(1 + count)][1:]
    if json:
        print(encoder.dumps({"scenario": str(scenario), "starts_s": starts}))
    else:
        show([_table(scenario, starts)], block)
    return 0


def processor_times(scenario: Path) -> dict[str, float]:
    """Start a stack and return the processor time of each process when all are ready [s].

    Args:
        scenario: File of the scenario.

    Raises:
        RuntimeError: The stack does not start.
    """
    with LiveStack(scenario) as stack:
        own, ended = cpu_times(stack.pid)
        found = {LAUNCHER: own, CHECK: ended}
        for child in _children(stack.pid):
            module = _module(child)
            if module:
                found[module] = sum(cpu_times(child))
    return found


def cpu_times(pid: int) -> tuple[float, float]:
    """Return the processor times of a process and of its children that have ended [s].

    Raises:
        OSError: There is no such process.
    """
    # The name, in parentheses, may hold anything; utime, stime, cutime, cstime: see proc(5).
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    user, system, ended_user, ended_system = (int(word) for word in words[11:15])
    return TICK * (user + system), TICK * (ended_user + ended_system)


def _children(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(word) for task in tasks for word in task.read_text().split()]


def _module(pid: int) -> str:
    """Return the last part of the module's name that a process of the stack runs."""
    words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
    places = [k for k, word in enumerate(words) if word.endswith("module_entry.py")]
    return words[places[0] + 1].rpartition(".")[2] if places else ""


def _table(scenario: Path, starts: Sequence[dict[str, float]]) -> Table:
    caption = f"{scenario}, median of {len(starts)} starts"
    table = Table(caption=caption)
    table.add_column("process")
    table.add_column("processor time s", justify="right")
    for name in starts[0]:
        table.add_row(name, f"{np.median([start[name] for start in starts]):.2f}")
    table.add_row("all", f"{np.median([sum(start.values()) for start in starts]):.2f}")
    return table
