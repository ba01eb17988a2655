"""Figure 9 of the paper, drawn from Lariat's runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.paper.closed_loop import PAPER_TIME_STEP
from benchmarks.paper.studies import StudyResult


def draw(methods: Sequence[StudyResult], adaptation: Sequence[StudyResult], path: Path) -> None:
    """Draw the error over time: by method (left), with and without adaptation (right)."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, (first, second) = pyplot.subplots(1, 2, figsize=(11.0, 4.2), sharey=True)
    for axes, results in ((first, methods), (second, adaptation)):
        for result in results:
            errors = 1e3 * np.stack([run.errors for run in result.runs])
            times = PAPER_TIME_STEP * np.arange(1, errors.shape[1] + 1)
            (line,) = axes.plot(times, errors.mean(axis=0), label=result.study.name, lw=1.3)
            low, high = np.percentile(errors, (10, 90), axis=0)
            axes.fill_between(times, low, high, color=line.get_color(), alpha=0.12, lw=0)
        axes.set_yscale("log")
        axes.set_xlabel("time [s]")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7)
    first.set_ylabel("mean node distance to the goal [mm]")
    first.set_title("methods; mean and 10 to 90 % of the goals", fontsize=9)
    second.set_title("the paper's rod, plant softer than believed", fontsize=9)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
