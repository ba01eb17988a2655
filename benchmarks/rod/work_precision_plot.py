"""Work-precision diagram: error over time, for each solver."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def draw(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write the diagram of errors in motion and at rest, one line for each solver.

    Args:
        rows: Rows of the table of `lariat bench rod --part diagram`.
        path: File to write, a PNG.
    """
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(10, 4.2), sharex=True)
    solvers = dict.fromkeys(row["solver"] for row in rows if math.isfinite(row["us"]))
    for axis, key, title in (
        (axes[0], "moving_mm", "in motion, against the continuum"),
        (axes[1], "rest_mm", "at rest, against the continuum"),
    ):
        for solver in solvers:
            points = sorted((r["us"], r[key], r["setting"]) for r in rows if r["solver"] == solver)
            axis.loglog(
                [p[0] for p in points], [max(p[1], 1e-7) for p in points], "o-", label=solver
            )
            for us, error, setting in points:
                axis.annotate(setting, (us, max(error, 1e-7)), fontsize=6)
        axis.set_xlabel("time for 10 ms of motion [us]")
        axis.set_title(title, fontsize=9)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("mean node error [mm]")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)
