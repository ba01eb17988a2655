"""Gradients, speed, robustness and accuracy of the rod: `lariat bench rod`."""

from __future__ import annotations

import json as encoder
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Literal, get_args

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks.result_block import find_block, show

Part = Literal["gradients", "speed", "batch", "start", "hard", "against-paper", "diagram", "growth"]
ALL_PARTS: tuple[Part, ...] = get_args(Part)
"""All parts, in the order of their tables."""
CAPTIONS: dict[Part, str] = {
    "gradients": "relative errors of adjoint gradients of 5 steps of 10 ms, in contact with a bar",
    "speed": "least processor time of 5 steps of 10 ms of a moving rod among four obstacles",
    "batch": "64 ropes, n = 40, 5 steps of 10 ms, no obstacles; wall time",
    "start": "time of a fresh process until its first gradient, n = 10, without and with kept code",
    "hard": "random rods of 5 to 401 nodes, both ends yanked, an obstacle in their middle",
    "against-paper": "n = 40, 5 steps of 10 ms, no contact; processor time",
    "diagram": "errors against the continuum, in motion and at rest; processor time of one core",
    "growth": "processor time of one core for 10 ms of motion of a rope",
}
"""Conditions of each table; plant, camera and adaptation are not involved."""


def run(
    part: tuple[Part, ...] = ALL_PARTS,
    cases: int = 1000,
    plots: Path | None = None,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Measure gradients, speed, start-up, robustness, and error against time of the rod.

    The parts are: `gradients` (adjoint against finite differences), `speed` (time of roll-outs and
    gradients by number of nodes), `batch` (throughput of many rods on threads, beside MuJoCo's
    ropes), `start` (time until the first gradient of a process), `hard`
    (rods that are yanked and start inside an obstacle), `against-paper` (gradients by Taichi's
    reverse mode through the paper's solver), `diagram` (error over time, beside the paper's
    solver, MuJoCo's ropes and, where they are installed, PyElastica and Newton), and `growth`
    (their time over nodes, obstacles and ropes). The rod is measured alone: no plant, camera or
    adaptation.

    Examples:
      lariat bench rod --part speed gradients
      lariat bench rod --part diagram growth --plots docs/results/rod

    Args:
        part: Parts to measure; all by default.
        cases: Number of random rods of the part `hard`.
        plots: Folder for error-against-time.png, the picture of `diagram` and `growth`.
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
        show([_table(name, rows) for name, rows in tables.items()], block)
    if plots is not None and "diagram" in tables:
        from benchmarks.rod.front.picture import draw

        draw(tables["diagram"], tables.get("growth", ()), plots / "error-against-time.png")
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
        case "against-paper":
            from benchmarks.paper import gradient_times
            from benchmarks.paper.studies import StudyRunner

            runner = StudyRunner(0)
            times = gradient_times.compare(runner.xpbd, runner.direct)
            return [{"quantity": name, "value": value} for name, value in times.items()]
        case "diagram":
            from benchmarks.rod.front import measurement

            with measurement.one_core():
                return [asdict(point) for point in measurement.points()]
        case "growth":
            from benchmarks.rod.front import growth, measurement

            with measurement.one_core():
                return [asdict(row) for row in growth.rows()]


def _table(name: Part, rows: Sequence[Mapping[str, object]]) -> Table:
    table = Table(title=name, caption=CAPTIONS[name])
    columns = list(dict.fromkeys(key for row in rows for key in row))
    for column in columns:
        table.add_column(column.replace("_", " "), justify="right")
    for row in rows:
        values = (row.get(column, "") for column in columns)
        table.add_row(*(f"{v:.4g}" if isinstance(v, float) else str(v) for v in values))
    return table
