"""Load of the dashboard's process of a live stack: `lariat bench speed page`.

Programs that read all that a page is sent stand for browsers, so that no browser competes for the
processor; a slow one reads a message only now and then. The processor time of the process comes
from the kernel, its step times from its health.
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from benchmarks.live_stack import LiveStack
from benchmarks.operator import RESET_TIMEOUT, Operator
from benchmarks.speed.endurance import sample_of
from benchmarks.speed.pages import OpenPages
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.scenario import find, load
from shared import topics

WARM_UP = 5.0
"""Time before the measurement [s]."""
SLOW_PAUSE = 0.5
"""Time after each message before a slow page reads the next one [s]."""


def run(
    scenario: Path = Path("three-cylinders"),
    pages: int = 1,
    slow_pages: int = 0,
    seconds: float = 30.0,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Print the load of the dashboard's process while a live stack runs back to back.

    Examples:
      lariat bench speed page
      lariat bench speed page --pages 0
      lariat bench speed page --slow-pages 1 --seconds 600

    Args:
        scenario: A scenario's TOML file, or the short name of a shipped one.
        pages: Number of pages that are open.
        slow_pages: Number of further pages that read two messages in a second.
        seconds: Duration of the measurement [s].
    """
    path = find(scenario)
    limit = load(path).run.time_limit + RESET_TIMEOUT
    with ExitStack() as cleanup:
        stack = cleanup.enter_context(LiveStack(path))
        operator = Operator(cleanup.enter_context(stack.connect()))
        health = operator.client.bus.subscribe(topics.HEALTH.at("dashboard"))
        readers = []
        for count, pause in ((pages, 0.0), (slow_pages, SLOW_PAUSE)):
            if count:
                readers.append(OpenPages(stack.address, count, pause))
                cleanup.callback(readers[-1].close)

        def run_for(duration: float) -> None:
            end = time.monotonic() + duration
            while time.monotonic() < end:
                operator.run_and_reset(limit)

        run_for(WARM_UP)
        operator.wait_until(lambda: "dashboard" in operator.health, RESET_TIMEOUT, "no dashboard")
        health.take()
        received = sum(reader.received for reader in readers)
        pid, begun = operator.health["dashboard"].process, time.monotonic()
        first = sample_of("dashboard", pid, 0.0)
        run_for(seconds)
        elapsed, last = time.monotonic() - begun, sample_of("dashboard", pid, 0.0)
        received = sum(reader.received for reader in readers) - received
        steps = [item.message for _, item in health.take()]
    used = last.processor_s - first.processor_s
    row = {
        "pages": pages,
        "slow_pages": slow_pages,
        "seconds": round(elapsed, 1),
        "processor_percent": round(100.0 * used / elapsed, 2),
        "step_p50_ms": round(float(np.median([h.step_p50_ms for h in steps])), 2),
        "step_p99_ms": round(float(np.median([h.step_p99_ms for h in steps])), 2),
        "memory_mb": (round(first.memory_mb, 1), round(last.memory_mb, 1)),
        "received_kb_s": round(received / elapsed / 1e3 / max(pages + slow_pages, 1), 1),
    }
    options.publish(Result("page", [row], str(scenario)))
    return 0
