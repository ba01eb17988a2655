"""Reliability diagram: stated doubt against the share of answers that are wrong."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt

BIN_COUNT = 6
"""Number of bins, with as many answers in each."""


def reliability(answers: list[tuple[float, bool]]) -> list[tuple[float, float, int]]:
    """Return mean stated doubt, share of wrong answers and their number, by rising doubt."""
    ordered = sorted(answers)
    bins = [b for b in np.array_split(np.arange(len(ordered)), BIN_COUNT) if len(b)]
    return [(*np.mean([ordered[k] for k in b], axis=0).tolist(), len(b)) for b in bins]


def draw_reliability(answers: list[tuple[float, bool]], path: Path) -> None:
    """Write the diagram: a point for each bin, with the standard error of its share.

    Args:
        answers: Stated probability of being wrong, and whether the answer is, for each.
        path: Image file.
    """
    stated, wrong, count = np.array(reliability(answers)).T
    # A share of nothing or all still has an error: that of half an answer.
    error = np.sqrt(np.maximum(wrong * (1.0 - wrong), 0.25 / count) / count)
    figure, axes = plt.subplots(figsize=(4.2, 4.2))
    axes.plot([0.0, 1.0], [0.0, 1.0], color="#7a7a7a", linewidth=1.0)
    axes.errorbar(stated, wrong, yerr=error, fmt="o", color="#d1495b")
    axes.set(xlabel="stated doubt", ylabel="share of answers that are wrong")
    axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), title=f"{len(answers)} pictures")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
