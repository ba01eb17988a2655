"""What the rod's speed and exactness are worth: `lariat bench rod`."""

from __future__ import annotations

import json as encoder
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Literal, get_args

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

Part = Literal["gradients", "speed", "start", "hard", "against-paper", "diagram"]
ALL: tuple[Part, ...] = get_args(Part)


def run(
    part: tuple[Part, ...] = ALL,
    cases: int = 1000,
    plots: Path | None = None,
    json: bool = False,
) -> int:
    """Measures gradients, speed, the first start, hard cases and error against time.

    And what a gradient takes by Taichi's reverse mode through the paper's solver.

    Examples:
      lariat bench rod --part speed gradients
      lariat bench rod --part diagram --plots docs

    Args:
        part: What to measure; everything by default.
        cases: Hard cases.
        plots: Folder for rod-error-against-time.png.
        json: One JSON object on standard output instead of tables.
    """
    tables: dict[str, list[Mapping[str, object]]] = {}
    with Progress(console=Console(stderr=True), transient=True) as progress:
        for name in part:
            task = progress.add_task(name, total=None)
            tables[name] = _measured(
                name, cases, lambda done, t=task: progress.update(t, completed=done)
            )
            progress.remove_task(task)
    if json:
        print(encoder.dumps(tables))
    else:
        console = Console()
        for name, rows in tables.items():
            console.print(_table(name, rows))
    if plots is not None and "diagram" in tables:
        from benchmarks.rod.work_precision_plot import draw

        draw(tables["diagram"], plots / "rod-error-against-time.png")
    return 0


def _measured(name: Part, cases: int, told: Callable[[int], None]) -> list[Mapping[str, object]]:
    match name:
        case "gradients":
            from benchmarks.rod import gradient_errors

            return [
                asdict(gradient_errors.row(n, tolerance))
                for tolerance in (1e-10, 1e-7)
                for n in (10, 40, 100)
            ]
        case "speed":
            from benchmarks.rod import speed

            rows = speed.by_size()
            return [*rows, {"nodes": 40, "batch": 64, "node_steps_per_s": speed.batched()}]
        case "start":
            from benchmarks.rod import speed

            return [dict(speed.first_launch())]
        case "hard":
            from benchmarks.rod import hard_cases

            return [dict(hard_cases.measured(cases, told))]
        case "against-paper":
            from benchmarks.paper import gradient_times
            from benchmarks.paper.studies import StudyRunner

            runner = StudyRunner(0)
            times = gradient_times.compare(runner.xpbd, runner.direct)
            return [{"what": what, "comes to": value} for what, value in times.items()]
        case "diagram":
            from benchmarks.rod import work_precision

            return [asdict(point) for point in work_precision.points()]


def _table(name: str, rows: Sequence[Mapping[str, object]]) -> Table:
    table = Table(title=name)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    for column in columns:
        table.add_column(column.replace("_", " "), justify="right")
    for row in rows:
        values = (row.get(column, "") for column in columns)
        table.add_row(*(f"{v:.4g}" if isinstance(v, float) else str(v) for v in values))
    return table
