"""Time of a stack's start: `lariat bench speed start`.

`lariat up` starts a scenario. When all processes are ready, the clock tells how long it took from
the command on, and the kernel the processor time of each process, which hardly depends on what else
the machine does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.child_processes import child_processes, processor_times
from benchmarks.live_stack import LiveStack
from benchmarks.result_block import find_block, report
from benchmarks.speed.first_view import FirstView, find_browser, first_view
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


@dataclass(frozen=True)
class StartTime:
    """Median of several starts."""

    what: str
    """Process, or what is there."""
    processor_s: float | None = None
    """Processor time until all processes are ready [s]."""
    after_s: float | None = None
    """Time from the command on, or from the opening of the page [s]."""


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
    words = f"{scenario}, median of {count} starts"
    report(list(medians(starts)), words, json=json, block=block)
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


def medians(starts: Sequence[Start]) -> Iterator[StartTime]:
    """Yield the medians of several starts: for each process, for all, and for the page."""
    for name in starts[0].processor_s:
        yield StartTime(name, median(start.processor_s[name] for start in starts))
    total = median(sum(start.processor_s.values()) for start in starts)
    yield StartTime("all are ready", total, median(start.ready_after for start in starts))
    if views := [start.first_view for start in starts if start.first_view]:
        painted = median(view.painted for view in views)
        usable = median(view.usable for view in views)
        yield StartTime("first view of the page, once opened", after_s=painted)
        yield StartTime("its controls", after_s=usable)
