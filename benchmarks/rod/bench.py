"""Gradients, speed and robustness of the rod: `lariat bench rod`."""

from __future__ import annotations

import json as encoder
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Literal, get_args

from rich.console import Console
from rich.progress import Progress

from benchmarks.result_block import find_block, numbers_table, show

Part = Literal["gradients", "speed", "batch", "start", "hard"]
ALL_PARTS: tuple[Part, ...] = get_args(Part)
"""All parts, in the order of their tables."""
CAPTIONS: dict[Part, str] = {
    "gradients": "relative errors of adjoint gradients of 5 steps of 10 ms, in contact with a bar",
    "speed": "least processor time of 5 steps of 10 ms of a moving rod among four obstacles",
    "batch": "64 ropes, n = 40, 5 steps of 10 ms, no obstacles; wall time",
    "start": "time of a fresh process until its first gradient, n = 10, without and with kept code",
    "hard": "random rods of 5 to 401 nodes, both ends yanked, an obstacle in their middle",
}
"""Conditions of each table; plant, camera and adaptation are not involved."""


def run(
    part: tuple[Part, ...] = ALL_PARTS,
    cases: int = 1000,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Measure gradients, speed, start-up and robustness of the rod.

    The parts are: `gradients` (adjoint against finite differences), `speed` (time of roll-outs and
    gradients by number of nodes), `batch` (throughput of many rods on threads, beside MuJoCo's
    ropes), `start` (time until the first gradient of a process) and `hard` (rods that are yanked
    and start inside an obstacle). The rod is measured alone: no plant, camera or adaptation.

    Examples:
      lariat bench rod --part speed gradients

    Args:
        part: Parts to measure; all by default.
        cases: Number of random rods of the part `hard`.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of tables.
    """
    block = find_block(docs)
    tables: dict[Part, list[Mapping[str, object]]] = {}
    with Progress(console=Console(stderr=True), transient=True) as progress:
        for name in part:
            task = progress.add_task(name, total=None)
            tables[name] = _measure(
                name, cases, lambda done, t=task: progress.update(t, completed=done)
            )
            progress.remove_task(task)
    if json:
        print(encoder.dumps(tables))
    else:
        show([numbers_table(name, rows, CAPTIONS[name]) for name, rows in tables.items()], block)
    return 0


def _measure(name: Part, cases: int, report: Callable[[int], None]) -> list[Mapping[str, object]]:
    match name:
        case "gradients":
            from benchmarks.rod import gradient_errors

            return [
                asdict(gradient_errors.measure(n, tolerance))
                for tolerance in (1e-10, 1e-7)
                for n in (10, 40, 100)
            ]
        case "speed":
            from benchmarks.rod import speed

            return [dict(row) for row in speed.by_size()]
        case "batch":
            from benchmarks.rod import batches

            return [asdict(rate) for rate in batches.rates()]
        case "start":
            from benchmarks.rod import speed

            return [dict(speed.first_launch())]
        case "hard":
            from benchmarks.rod import hard_cases

            return [dict(hard_cases.measure(cases, report))]
