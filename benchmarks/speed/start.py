"""Time of a stack's start: `lariat bench speed start`.

`lariat up` starts a scenario. When all processes are ready, the clock tells how long it took from
the command on, and the kernel the processor time of each process, which hardly depends on what else
the machine does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

from benchmarks.child_processes import child_processes, processor_times
from benchmarks.live_stack import LiveStack
from benchmarks.speed.first_view import find_browser, first_view
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.scenario import find

CHECK = "check of the scenario"
"""Name of the process that checks the scenario before the others start."""
READY, PAINTED, USABLE = "all are ready", "first view of the page, once opened", "its controls"
"""Names of what is there after a time."""
Start = tuple[dict[str, float], dict[str, float]]
"""Processor time of each process until all are ready [s]; times after which something is there."""


def run(
    scenario: Path = Path("three-cylinders"),
    count: int = 3,
    browser: bool = False,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
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
    """
    path = find(scenario)
    program = find_browser() if browser else None
    starts = [measure_start(path, program) for _ in range(1 + count)][1:]
    conditions = f"{scenario}, median of {count} starts"
    options.publish(Result("starts", list(medians(starts)), conditions))
    return 0


def measure_start(scenario: Path, browser: str | None = None) -> Start:
    """Start a stack and return its times when all processes are ready.

    Raises:
        RuntimeError: The stack does not start.
    """
    with LiveStack(scenario) as stack:
        own, ended = processor_times(stack.pid)
        used = {"lariat up": own, CHECK: ended}
        for child, name in child_processes(stack.pid).items():
            used[name] = sum(processor_times(child))
        after = {READY: stack.ready_after}
        if browser is not None:
            after[PAINTED], after[USABLE] = first_view(browser, stack.address)
        return used, after


def medians(starts: Sequence[Start]) -> Iterator[dict[str, object]]:
    """Yield the medians of several starts: for each process, for all, and for the page."""
    for name in starts[0][0]:
        yield {"what": name, "processor_s": median(used[name] for used, _ in starts)}
    total = median(sum(used.values()) for used, _ in starts)
    for name in starts[0][1]:
        after = median(times[name] for _, times in starts)
        yield {"what": name, "processor_s": total if name == READY else None, "after_s": after}
