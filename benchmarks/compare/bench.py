"""Solvers side by side: `lariat bench compare`.

All settings of all solvers are compared with the continuum in one process on one core.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.compare import continuum, mujoco_ropes, our_rod
from benchmarks.compare.continuum import Continuum
from benchmarks.compare.motion import ACTION_COUNT, Contender, actions
from benchmarks.plots import figure_of, save
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result

ROUNDS, ROUND_TIME = 3, 0.7
"""Number of runs of a contender, of which the fastest counts, and time above which it runs once."""
COLORS = {
    "Lariat, 1st order": "#56B4E9",
    "Lariat, 2nd order": "#0072B2",
    "paper's XPBD": "#E69F00",
    "MuJoCo flex": "#D55E00",
    "MuJoCo links": "#CC79A7",
}
"""Color of each solver: the palette of Okabe and Ito, which color-blind people can tell apart."""
GAIN = 0.97
"""Ratio of errors below which a slower setting is better [-]."""
Row = Mapping[str, Any]


def run(plot: Path | None = None, options: Flat[PrintOptions] = PRINT_DEFAULTS) -> int:
    """Compare the rod with other solvers: error over time.

    They are the paper's solver and MuJoCo's ropes. The rod is measured alone: no plant, camera or
    adaptation.

    Examples:
      lariat bench compare
      lariat bench compare --plot docs/results/rod/error-against-time.png

    Args:
        plot: File for a picture of the table, a PNG.
    """
    with _one_core():
        rows = points()
    conditions = "errors against the continuum, in motion and at rest; processor time of one core"
    options.publish(Result("diagram", rows, conditions))
    if plot is not None:
        _draw(rows, plot)
    return 0


def points() -> list[dict[str, Any]]:
    """Return the continuum's own error, then a row for every contender.

    `us` is the least processor time for 10 ms of motion, the errors are distances of nodes from the
    continuum [mm]: mean and largest in motion, and mean at rest.
    """
    there = continuum.solve(actions())
    contenders = [*our_rod.contenders(), *mujoco_ropes.contenders()]
    rows = [_measure(contender, there) for contender in contenders]
    for _ in range(1, ROUNDS):
        for row, contender in zip(rows, contenders, strict=True):
            if row["us"] * ACTION_COUNT < 1e6 * ROUND_TIME:
                row["us"] = min(row["us"], _timed_run(contender)[1])
    reference = _row("reference", continuum.NODE_COUNT, "by Richardson")
    return [{**reference, "moving_mm": there.own_error_mm}, *rows]


def _row(solver: str, nodes: int, setting: str, *figures: float) -> dict[str, Any]:
    names = ("us", "moving_mm", "worst_mm", "rest_mm")
    row = {"solver": solver, "nodes": nodes, "setting": setting}
    return row | dict(zip(names, figures or (np.nan,) * len(names), strict=True))


@contextmanager
def _one_core() -> Iterator[None]:
    """Keep this process on one core, where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def _measure(contender: Contender, there: Continuum) -> dict[str, Any]:
    # The first run of a setting compiles, reads caches and takes memory.
    contender.start(actions()[:1]).run()
    simulation, us, path = _timed_run(contender)
    errors = there.moving_errors(path)
    rest = float(there.rest_errors(simulation.settle()).mean())
    setting = contender.solver, contender.nodes, contender.setting
    return _row(*setting, us, float(errors.mean()), float(errors.max()), rest)


def _timed_run(contender: Contender):
    simulation = contender.start(actions())
    began = time.process_time()
    path = simulation.run()
    return simulation, 1e6 * (time.process_time() - began) / ACTION_COUNT, path


def _draw(rows: Sequence[Row], path: Path) -> None:
    """Draw error over time in motion and at rest, to a PNG."""
    figure, axes = figure_of(1, 2, (13.0, 6.0))
    panels = {"moving_mm": "In motion", "rest_mm": "At rest afterwards"}
    for axis, (key, title) in zip(axes, panels.items(), strict=True):
        shown = [row for row in rows if row["us"] == row["us"] and row[key] == row[key]]
        for solver, color in COLORS.items():
            own = [row for row in shown if row["solver"] == solver]
            axis.plot(*_columns(own, "us", key), "o", color=color, alpha=0.35, markersize=4)
            best = unbeaten(own, key)
            axis.plot(*_columns(best, "us", key), "o-", color=color, label=solver)
        front = unbeaten(shown, key)
        axis.step(*_columns(front, "us", key), "k:", where="post", label="best of all")
        axis.set(xscale="log", yscale="log", title=f"{title}; lines: the best settings")
        axis.set_xlabel("processor time for 10 ms of motion [µs]")
        axis.set_ylabel("mean distance from the continuum [mm]")
    axes[0].axhline(rows[0]["moving_mm"], color="0.6", label="error of the reference")
    save(figure, path)


def unbeaten(rows: Sequence[Row], key: str) -> list[Row]:
    """Return the rows that are better than all faster ones, fastest first."""
    best: list[Row] = []
    for row in sorted(rows, key=lambda row: row["us"]):
        if not best or row[key] < GAIN * best[-1][key]:
            best.append(row)
    return best


def _columns(rows: Sequence[Row], x: str, y: str) -> tuple[list[float], list[float]]:
    return [row[x] for row in rows], [row[y] for row in rows]
