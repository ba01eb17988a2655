"""Reliability diagram: stated doubt against the share of answers that are wrong."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from benchmarks.perception.instances.judgement import Judgement

mpl.use("Agg")
from matplotlib import pyplot as plt

BIN_COUNT = 6
"""Number of bins, with as many answers in each."""


def reliability(judged: list[Judgement]) -> list[tuple[float, float, int]]:
    """Return mean stated doubt, share of wrong answers and their number, by rising doubt."""
    ordered = sorted(judged, key=lambda j: j.doubt)
    bins = [b for b in np.array_split(np.arange(len(ordered)), BIN_COUNT) if len(b)]
    return [
        (
            float(np.mean([ordered[k].doubt for k in b])),
            float(np.mean([not ordered[k].right for k in b])),
            len(b),
        )
        for b in bins
    ]


def draw_reliability(judged: list[Judgement], path: Path) -> None:
    """Write the diagram: a point for each bin, with the standard error of its share."""
    stated, wrong, count = np.array(reliability(judged)).T
    # A share of nothing or all still has an error: that of half an answer.
    error = np.sqrt(np.maximum(wrong * (1.0 - wrong), 0.25 / count) / count)
    figure, axes = plt.subplots(figsize=(4.2, 4.2))
    axes.plot([0.0, 1.0], [0.0, 1.0], color="#7a7a7a", linewidth=1.0)
    axes.errorbar(stated, wrong, yerr=error, fmt="o", color="#d1495b")
    axes.set(xlabel="stated doubt", ylabel="share of answers that are wrong")
    axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), title=f"{len(judged)} pictures")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
