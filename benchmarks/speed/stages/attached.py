"""Time by stage of the processes of a running stack: `lariat bench speed live --attach`."""

from __future__ import annotations

import json as encoder
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.speed.stages.sampling import sample_processes
from benchmarks.speed.stages.stages import times
from lariat.configuration import ConfigurationError
from shared import topics
from shared.messages import Health
from stack.client import Cell, connect

LISTENING_TIME = 1.5
"""Duration for which health is awaited [s]; every process publishes its own once a second."""
POLL_PERIOD = 0.02
"""Time between two reads of the subscription [s]."""
MIN_SHARE = 0.001
"""Share of a core below which a stage is not printed [-]."""


def run(duration: int, cell: Cell, keep: Path | None, *, json: bool) -> None:
    """Sample a running stack and print the time of each stage.

    Args:
        duration: Duration of the sampling [s].
        cell: Address of the stack, which runs on this machine.
        keep: Folder for the profiles.
        json: Whether to print one JSON object.

    Raises:
        ConfigurationError: No process answers, or one cannot be sampled.
    """
    healths = _healths(cell)
    if not healths:
        raise ConfigurationError("no process of the stack answers; start one by `lariat up`")
    samples = sample_processes({n: h.process for n, h in healths.items()}, duration, keep)
    rows: list[dict[str, Any]] = []
    for name, health in healths.items():
        steps = duration * 1e3 / health.period_ms
        for stage, seconds in times(samples[name], name).most_common():
            rows.append(
                {
                    "process": name,
                    "stage": stage.name,
                    "core": round(seconds / duration, 4),
                    "us_per_step": round(1e6 * seconds / steps),
                }
            )
    if json:
        print(encoder.dumps({"seconds": duration, "stages": rows}))
    else:
        _print(rows)


def _healths(cell: Cell) -> dict[str, Health]:
    """Return the newest health of each process by name."""
    found: dict[str, Health] = {}
    with connect(cell) as client:
        subscription = client.bus.subscribe(topics.HEALTH)
        deadline = time.monotonic() + LISTENING_TIME
        while time.monotonic() < deadline:
            found.update({item.message.service: item.message for _, item in subscription.take()})
            time.sleep(POLL_PERIOD)
    return {name: health for name, health in sorted(found.items()) if health.period_ms > 0.0}


def _print(rows: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    table.add_column("process")
    table.add_column("stage")
    for head in ("% of a core", "µs per step"):
        table.add_column(head, justify="right")
    shown = ""
    for row in rows:
        if row["core"] < MIN_SHARE:
            continue
        name = row["process"] if row["process"] != shown else ""
        table.add_row(name, row["stage"], f"{100.0 * row['core']:.1f}", str(row["us_per_step"]))
        shown = row["process"]
    Console(file=sys.stdout, width=120).print(table)
