"""Time of a stack's start: `lariat bench speed start`.

`lariat up` starts a scenario. When all processes are ready, the clock tells how long it took from
the command on, and the kernel the processor time of each process, which hardly depends on what else
the machine does.
"""

from __future__ import annotations

import json as encoder
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.table import Table

from benchmarks.child_processes import child_processes
from benchmarks.live_stack import LiveStack
from benchmarks.result_block import find_block, show
from benchmarks.speed.first_view import FirstView, find_browser, first_view
from benchmarks.speed.processor_time import processor_times
from lariat.scenario import find

LAUNCHER = "lariat up"
"""Name of the launcher."""
CHECK = "check of the scenario"
"""Name of the process that checks the scenario before the others start."""


@dataclass(frozen=True)
class Start:
    """Times of one start."""

    ready_after: float
    """Time from the command until all processes are ready [s]."""
    processor_s: dict[str, float]
    """Processor time of each process until then [s]."""
    first_view: FirstView | None = None
    """Times of a browser that then opens the page."""


def run(
    scenario: Path = Path("three-cylinders"),
    count: int = 3,
    browser: bool = False,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Start a stack several times, and measure when it is ready and what each process takes.

    One start that is not counted comes first: it compiles kernels that are not kept yet.

    Examples:
      lariat bench speed start
      lariat bench speed start --scenario two-arms --count 5
      lariat bench speed start --browser

    Args:
        scenario: A scenario's TOML file, or the short name of a shipped one.
        count: Number of starts.
        browser: Also open the page in headless Chromium once all are ready, and measure when it
            first shows something, and when its controls are there.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.
    """
    block = find_block(docs)
    path = find(scenario)
    program = find_browser() if browser else None
    starts = [measure_start(path, program) for _ in range(1 + count)][1:]
    if json:
        rows = [asdict(start) for start in starts]
        print(encoder.dumps({"scenario": str(scenario), "starts": rows}))
    else:
        show([_table(scenario, starts)], block)
    return 0


def measure_start(scenario: Path, browser: str | None = None) -> Start:
    """Start a stack and return its times when all processes are ready.

    Raises:
        RuntimeError: The stack does not start.
    """
    with LiveStack(scenario) as stack:
        own, ended = processor_times(stack.pid)
        found = {LAUNCHER: own, CHECK: ended}
        for child, name in child_processes(stack.pid).items():
            found[name] = sum(processor_times(child))
        view = None if browser is None else first_view(browser, stack.address)
        return Start(stack.ready_after, found, view)


def _table(scenario: Path, starts: Sequence[Start]) -> Table:
    table = Table(caption=f"{scenario}, median of {len(starts)} starts")
    table.add_column("process")
    table.add_column("processor time s", justify="right")
    table.add_column("after s", justify="right")
    for name in starts[0].processor_s:
        table.add_row(name, f"{np.median([start.processor_s[name] for start in starts]):.2f}", "")
    total = np.median([sum(start.processor_s.values()) for start in starts])
    ready = np.median([start.ready_after for start in starts])
    table.add_row("all are ready", f"{total:.2f}", f"{ready:.2f}")
    views = [start.first_view for start in starts if start.first_view is not None]
    if views:
        painted = np.median([view.painted for view in views])
        usable = np.median([view.usable for view in views])
        table.add_row("first view of the page, once opened", "", f"{painted:.2f}")
        table.add_row("its controls", "", f"{usable:.2f}")
    return table
