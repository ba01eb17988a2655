"""Solvers side by side: `lariat bench compare`."""

from __future__ import annotations

import json as encoder
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Literal, get_args

from benchmarks.compare import growth, measurement
from benchmarks.result_block import find_block, numbers_table, show

Part = Literal["diagram", "growth", "paper"]
ALL_PARTS: tuple[Part, ...] = get_args(Part)
"""All parts, in the order of their tables."""
CAPTIONS: dict[Part, str] = {
    "diagram": "errors against the continuum, in motion and at rest; processor time of one core",
    "growth": "processor time of one core for 10 ms of motion of a rope",
    "paper": "n = 40, 5 steps of 10 ms, no contact; processor time",
}
"""Conditions of each table; plant, camera and adaptation are not involved."""


def run(
    part: tuple[Part, ...] = ALL_PARTS,
    plots: Path | None = None,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Compare the rod with other solvers: error over time, and growth with size.

    The parts are: `diagram` (error over time, beside the paper's solver, MuJoCo's ropes and, where
    they are installed, PyElastica and Newton), `growth` (their time over nodes, obstacles and
    ropes) and `paper` (gradients by Taichi's reverse mode through the paper's solver). The rod is
    measured alone: no plant, camera or adaptation.

    Examples:
      lariat bench compare
      lariat bench compare --part diagram growth --plots docs/results/rod

    Args:
        part: Parts to measure; all by default.
        plots: Folder for error-against-time.png, the picture of `diagram` and `growth`.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of tables.
    """
    block = find_block(docs)
    rows = {name: _measure(name) for name in part}
    if json:
        print(encoder.dumps(rows))
    else:
        show([numbers_table(name, rows[name], CAPTIONS[name]) for name in part], block)
    if plots is not None and "diagram" in rows:
        from benchmarks.compare.picture import draw

        draw(rows["diagram"], rows.get("growth", ()), plots / "error-against-time.png")
    return 0


def _measure(name: Part) -> list[Mapping[str, object]]:
    if name == "paper":
        from benchmarks.paper import gradient_times
        from benchmarks.paper.studies import rods

        return [*gradient_times.compare(*rods())]
    with measurement.one_core():
        rows = measurement.points() if name == "diagram" else growth.rows()
        return [asdict(row) for row in rows]
