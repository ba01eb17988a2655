"""Picture of the diagram: error over time in motion and at rest, and growth of the time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.compare.measurement import REFERENCE

Row = Mapping[str, Any]
"""Row of a table of `lariat bench rod --part diagram growth`."""
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
TITLES = {
    "nodes": "Growth with nodes",
    "obstacles": "Growth with obstacles touched, n = 40",
    "ropes": "Growth with ropes in a call, n = 40",
}
"""Titles of the panels of growth, by the quantity that grows."""
LABELS = {
    "Lariat, 1st order": (-1, 2, -19, "left"),
    "Lariat, 2nd order": (-1, 9, -4, "left"),
    "paper's XPBD": (0, -26, 9, "left"),
    "MuJoCo flex": (-1, 0, -17, "center"),
    "MuJoCo links": (0, 6, 14, "left"),
    "PyElastica": (0, 4, 8, "left"),
    "Newton cable": (0, 6, 6, "left"),
}
"""Place of the name of each solver: point of its line, offset from it [pt], and side."""
GAIN = 0.97
"""Ratio of errors below which a slower setting is better [-]."""
LABEL_GAP = 0.085
"""Smallest distance of two labels beside a panel of growth, relative to its height [-]."""


def draw(points: Sequence[Row], growth: Sequence[Row], path: Path) -> None:
    """Write the picture.

    Args:
        points: Rows of the part `diagram`.
        growth: Rows of the part `growth`; without them, its panels are left out.
        path: File to write, a PNG.
    """
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure = pyplot.figure(figsize=(13.0, 10.5 if growth else 6.2))
    heights = [1.6, 1.0][: 1 + bool(growth)]
    grid = figure.add_gridspec(
        len(heights), 6, height_ratios=heights, hspace=0.25, wspace=2.2,
        left=0.055, right=0.9, top=0.96, bottom=0.06,
    )  # fmt: skip
    moving, resting = figure.add_subplot(grid[0, :3]), figure.add_subplot(grid[0, 3:])
    _front(moving, points, "moving_mm", "In motion")
    _front(resting, points, "rest_mm", "At rest afterwards")
    doubt = next((row["moving_mm"] for row in points if row["solver"] == REFERENCE), math.nan)
    moving.axhspan(1e-9, doubt, color="0.9", zorder=0)
    moving.text(
        0.99, 0.01, "error of the reference", transform=moving.transAxes, ha="right", va="bottom",
        fontsize=8, color="0.35",
    )  # fmt: skip
    moving.text(
        0.985, 0.975,
        "dots: every setting\nlines: the best of each solver\ndotted: the best of all",
        transform=moving.transAxes, ha="right", va="top", fontsize=8, color="0.35",
    )  # fmt: skip
    for k, (quantity, title) in enumerate(TITLES.items() if growth else ()):
        rows = [row for row in growth if row["grows"] == quantity]
        _growth(figure.add_subplot(grid[1, 2 * k : 2 * k + 2]), rows, quantity, title)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
    pyplot.close(figure)


def _front(axis: Any, points: Sequence[Row], key: str, title: str) -> None:
    """Draw the settings of every solver as dots, and a line through those that none beats."""
    shown = [row for row in points if math.isfinite(row["us"]) and math.isfinite(row[key])]
    for solver, rows in _by_solver(shown).items():
        color = COLORS.get(solver, "0.5")
        axis.plot(*_columns(rows, key), "o", color=color, alpha=0.35, markersize=4, mew=0)
        best = _unbeaten(rows, key)
        axis.plot(*_columns(best, key), "o-", color=color, linewidth=2.4, markersize=6)
        end, right, up, side = LABELS.get(solver, (0, 4, 7, "left"))
        axis.annotate(
            solver, (best[end]["us"], best[end][key]), xytext=(right, up), ha=side,
            textcoords="offset points", fontsize=10.5, fontweight="bold", color=color,
        )  # fmt: skip
    front = _unbeaten(shown, key)
    axis.step(*_columns(front, key), where="post", color="0.25", linewidth=1.0, linestyle=":")
    named: Row = {"us": 0.0, key: math.inf}
    for row in front:
        if row["us"] < 6.0 * named["us"] and row[key] > 0.75 * named[key]:
            # Its text would lie on that of the one before.
            continue
        named = row
        axis.annotate(
            f"n={row['nodes']}, {row['setting']}", (row["us"], row[key]), xytext=(-6, -3),
            textcoords="offset points", ha="right", va="top", fontsize=7, color="0.3",
        )  # fmt: skip
    axis.set(xscale="log", yscale="log")
    axis.set_xlim(min(row["us"] for row in shown) / 8.0, 3.0 * max(row["us"] for row in shown))
    axis.set_ylim(min(row[key] for row in shown) / 4.0, 2.0 * max(row[key] for row in shown))
    axis.set_title(title, fontsize=12, fontweight="bold")
    axis.set_xlabel("processor time for 10 ms of motion [µs]")
    axis.set_ylabel("mean distance from the continuum [mm]")
    axis.grid(alpha=0.25)


def _by_solver(rows: Sequence[Row]) -> dict[str, list[Row]]:
    solvers = dict.fromkeys(row["solver"] for row in rows)
    return {solver: [row for row in rows if row["solver"] == solver] for solver in solvers}


def _columns(rows: Sequence[Row], key: str) -> tuple[list[float], list[float]]:
    return [row["us"] for row in rows], [row[key] for row in rows]


def _unbeaten(rows: Sequence[Row], key: str) -> list[Row]:
    """Return the rows that are better than all faster ones, fastest first."""
    found: list[Row] = []
    for row in sorted(rows, key=lambda row: row["us"]):
        if not found or row[key] < GAIN * found[-1][key]:
            found.append(row)
    return found


def _growth(axis: Any, rows: Sequence[Row], quantity: str, title: str) -> None:
    solvers = _by_solver(rows)
    gap = (max(row["us"] for row in rows) / min(row["us"] for row in rows)) ** LABEL_GAP
    height = 0.0
    for solver, mine in sorted(solvers.items(), key=lambda item: item[1][-1]["us"]):
        color = COLORS.get(solver, "0.5")
        counts, us = [row["count"] for row in mine], [row["us"] for row in mine]
        axis.plot(counts, us, "o-", color=color, linewidth=1.8, markersize=4)
        height = max(us[-1], gap * height)
        axis.annotate(
            f"{solver}\n{mine[0]['setting']}", (1.02, height), xycoords=("axes fraction", "data"),
            va="center", fontsize=6.5, color=color, annotation_clip=False,
        )  # fmt: skip
    axis.set(xscale="symlog" if quantity == "obstacles" else "log", yscale="log")
    ticks = sorted({row["count"] for row in rows})
    axis.set_xticks(ticks, [str(tick) for tick in ticks])
    axis.xaxis.minorticks_off()
    axis.set_title(title, fontsize=10, fontweight="bold")
    if quantity == "nodes":
        axis.set_ylabel("processor time for 10 ms of a rope [µs]")
    axis.grid(alpha=0.25)
