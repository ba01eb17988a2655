"""Solvers side by side: `lariat bench compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

from benchmarks.compare import growth, measurement
from benchmarks.tables import Result, publish

Part = Literal["diagram", "growth", "paper"]
ALL_PARTS: tuple[Part, ...] = get_args(Part)
"""All parts, in the order of their tables."""
CONDITIONS: dict[Part, str] = {
    "diagram": "errors against the continuum, in motion and at rest; processor time of one core",
    "growth": "processor time of one core for 10 ms of motion of a rope",
    "paper": "n = 40, 5 steps of 10 ms, no contact; processor time",
}
"""Conditions of each table; plant, camera and adaptation are not involved."""


def run(
    part: tuple[Part, ...] = ALL_PARTS,
    plot: Path | None = None,
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Compare the rod with other solvers: error over time, and growth with size.

    The parts are: `diagram` (error over time, beside the paper's solver, MuJoCo's ropes and, where
    they are installed, PyElastica and Newton), `growth` (their time over nodes, obstacles and
    ropes) and `paper` (gradients by Taichi's reverse mode through the paper's solver). The rod is
    measured alone: no plant, camera or adaptation.

    Examples:
      lariat bench compare
      lariat bench compare --part diagram growth --plot docs/results/rod/error-against-time.png

    Args:
        part: Parts to measure; all by default.
        plot: File for the picture of `diagram` and `growth`, a PNG.
        json: Print one JSON object instead of tables.
        output: Folder for the tables as CSV.
    """
    rows = {name: _measure(name) for name in part}
    publish([Result(name, rows[name], CONDITIONS[name]) for name in part], json, output)
    if plot is not None and "diagram" in rows:
        from benchmarks.compare.picture import draw

        draw(rows["diagram"], rows.get("growth", ()), plot)
    return 0


def _measure(name: Part) -> list[dict[str, object]]:
    if name == "paper":
        from benchmarks.paper import gradient_times
        from benchmarks.paper.studies import rods

        return gradient_times.compare(*rods())
    with measurement.one_core():
        return measurement.points() if name == "diagram" else growth.rows()
