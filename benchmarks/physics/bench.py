"""The rod against the continuum and closed forms: `lariat bench physics`."""

from __future__ import annotations

import importlib
import json as encoder
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks.physics.convergence import Case, Convergence, measure
from benchmarks.result_block import find_block, show

Part = Literal[
    "elasticae",
    "closed-forms",
    "frequencies",
    "buckling",
    "stiffness",
    "writhing",
    "whip",
    "plants",
]
ALL_PARTS: tuple[Part, ...] = get_args(Part)
"""All parts, in the order of their tables; a part is the module of its name."""
CAPTIONS: dict[Part, str] = {
    "elasticae": "ropes at rest, mean distance of nodes from the continuum at equal arc length",
    "closed-forms": "shapes and moments with closed forms",
    "frequencies": "natural frequencies of straight beams, against Euler-Bernoulli beams",
    "buckling": "critical loads of straight rods and a ring",
    "stiffness": "Young's modulus fitted to shapes of the continuum",
    "writhing": "twisted rods that buckle, and a loop that twists round itself",
    "whip": "change of energy of a flicked whip, relative to its kinetic energy",
    "plants": "simulated ropes at rest, mean distance of nodes from the continuum; processor time",
}
"""Conditions of each table; camera and adaptation are not involved."""

TABLE_WIDTH = 132
"""Width of the tables [characters]."""


def run(
    part: tuple[Part, ...] = ALL_PARTS,
    plot: Path | None = None,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Measure the rod's errors over its number of nodes, and compare them with their bounds.

    There is no camera or adaptation: each error is that of a rod itself with n nodes. The parts
    are: `elasticae` (hanging ropes, against boundary value solutions of the continuum),
    `closed-forms`, `frequencies`, `buckling`, `stiffness` (Young's modulus identified from exact
    shapes), `writhing`, `whip` and `plants` (hanging ropes of the simulated lab, and their cost).
    The order is that of the error in the length of an edge, between the smallest and the largest
    number of nodes.

    Examples:
      lariat bench physics --plot docs/results/rod/physics.png
      lariat bench physics --part elasticae buckling

    Args:
        part: Parts to measure; all by default.
        plot: File for a plot of shapes and errors, a PNG.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of tables.

    Returns:
        0 if all errors and orders are within their bounds, else 1.
    """
    block = find_block(docs)
    measured: dict[Part, list[Convergence]] = {}
    with Progress(console=Console(stderr=True), transient=True) as progress:
        for name in part:
            cases: Sequence[Case] = importlib.import_module(
                f"benchmarks.physics.{name.replace('-', '_')}"
            ).CASES
            task = progress.add_task(name, total=sum(len(case.node_counts) for case in cases))
            measured[name] = []
            for case in cases:
                progress.update(task, description=f"{name}: {case.name}")
                measured[name].append(measure(case, lambda _, t=task: progress.advance(t)))
            progress.remove_task(task)
    held = all(found.held for name in part for found in measured[name])
    if json:
        rows = {name: [_row(found) for found in measured[name]] for name in part}
        print(encoder.dumps({**rows, "held": held}))
    else:
        show([_table(name, measured[name]) for name in part], block, TABLE_WIDTH)
        console = Console(width=TABLE_WIDTH)
        for name in part:
            for found in measured[name]:
                if not found.held:
                    console.print(f"{name}: {found.case.name}: a bound does not hold", style="red")
    if plot is not None:
        from benchmarks.physics.plot import draw

        draw(measured, plot)
    return 0 if held else 1


def _row(found: Convergence) -> dict[str, object]:
    case = found.case
    return {
        "case": case.name,
        "unit": case.unit,
        "nodes": case.node_counts,
        "errors": [error.value for error in found.errors],
        "largest": [error.largest for error in found.errors],
        "order": found.order,
        "bounds": {str(n): bound for n, bound in case.bounds.items()},
        "min_order": case.min_order,
        "held": found.held,
    }


def _table(name: Part, cases: Sequence[Convergence]) -> Table:
    """Return a table of one part: a column for each number of nodes."""
    counts = sorted({n for found in cases for n in found.case.node_counts})
    table = Table(title=f"{name}: {CAPTIONS[name]}", title_justify="left")
    table.add_column("case", no_wrap=True)
    table.add_column("unit")
    for count in counts:
        table.add_column(f"n={count}", justify="right")
    for title in ("order", "bound"):
        table.add_column(title, justify="right")
    for found in cases:
        case = found.case
        errors = dict(zip(case.node_counts, found.errors, strict=True))
        has_order = case.min_order is not None and found.order is not None
        table.add_row(
            case.name,
            case.unit,
            *(f"{errors[n].value:.2g}" if n in errors else "" for n in counts),
            f"{found.order:.2f}" if has_order else "",
            ", ".join(f"{bound:.2g} at {n}" for n, bound in case.bounds.items()),
        )
    return table
