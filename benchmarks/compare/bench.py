"""Solvers side by side: `lariat bench compare`."""

from __future__ import annotations

from pathlib import Path

from benchmarks.compare import measurement
from benchmarks.tables import Result, publish

CONDITIONS = "errors against the continuum, in motion and at rest; processor time of one core"


def run(plot: Path | None = None, json: bool = False, output: Path | None = None) -> int:
    """Compare the rod with other solvers: error over time.

    They are the paper's solver, MuJoCo's ropes and, where they are installed, PyElastica and
    Newton. The rod is measured alone: no plant, camera or adaptation.

    Examples:
      lariat bench compare
      lariat bench compare --plot docs/results/rod/error-against-time.png

    Args:
        plot: File for a picture of the table, a PNG.
        json: Print one JSON object instead of a table.
        output: Folder for the table as CSV.
    """
    with measurement.one_core():
        rows = measurement.points()
    publish([Result("diagram", rows, CONDITIONS)], json, output)
    if plot is not None:
        from benchmarks.compare.picture import draw

        draw(rows, plot)
    return 0
