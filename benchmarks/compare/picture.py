"""Picture of the table: error over time in motion and at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.compare.measurement import REFERENCE
from benchmarks.plots import figure_of, save

Row = Mapping[str, Any]
"""Row of the table of `lariat bench compare`."""
COLORS = {
    "Lariat, 1st order": "#56B4E9",
    "Lariat, 2nd order": "#0072B2",
    "paper's XPBD": "#E69F00",
    "MuJoCo flex": "#D55E00",
    "MuJoCo links": "#CC79A7",
    "PyElastica": "#009E73",
    "Newton cable": "#444444",
}
"""Color of each solver: the palette of Okabe and Ito, which color-blind people can tell apart."""
ERRORS = {"moving_mm": "In motion", "rest_mm": "At rest afterwards"}
"""Titles of the panels of errors, by column."""
GAIN = 0.97
"""Ratio of errors below which a slower setting is better [-]."""


def draw(points: Sequence[Row], path: Path) -> None:
    """Write the picture of a table, a PNG."""
    figure, axes = figure_of(1, 2, (13.0, 6.0))
    own_error = next(row["moving_mm"] for row in points if row["solver"] == REFERENCE)
    for axis, (key, title) in zip(axes, ERRORS.items(), strict=True):
        shown = [row for row in points if row["us"] == row["us"] and row[key] == row[key]]
        for solver, rows in _by_solver(shown).items():
            color = COLORS.get(solver)
            axis.plot(*_columns(rows, "us", key), "o", color=color, alpha=0.35, markersize=4)
            best = unbeaten(rows, key)
            axis.plot(*_columns(best, "us", key), "o-", color=color, label=solver)
        front = unbeaten(shown, key)
        axis.step(*_columns(front, "us", key), "k:", where="post", label="best of all")
        axis.set(xscale="log", yscale="log", title=f"{title}; lines: the best settings")
        axis.set_xlabel("processor time for 10 ms of motion [µs]")
        axis.set_ylabel("mean distance from the continuum [mm]")
    axes[0].axhline(own_error, color="0.6", label="error of the reference")
    save(figure, path)


def unbeaten(rows: Sequence[Row], key: str) -> list[Row]:
    """Return the rows that are better than all faster ones, fastest first."""
    best: list[Row] = []
    for row in sorted(rows, key=lambda row: row["us"]):
        if not best or row[key] < GAIN * best[-1][key]:
            best.append(row)
    return best


def _by_solver(rows: Sequence[Row]) -> dict[str, list[Row]]:
    solvers = dict.fromkeys(row["solver"] for row in rows)
    return {solver: [row for row in rows if row["solver"] == solver] for solver in solvers}


def _columns(rows: Sequence[Row], x: str, y: str) -> tuple[list[float], list[float]]:
    return [row[x] for row in rows], [row[y] for row in rows]
