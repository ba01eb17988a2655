"""Reliability diagram: stated doubt against the share of answers that are wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.plots import figure_of, save

BIN_COUNT = 6
"""Number of bins, with as many answers in each."""


def draw_reliability(answers: list[tuple[float, bool]], path: Path) -> None:
    """Write the diagram: a point for each bin, with the standard error of its share.

    Args:
        answers: Stated probability of being wrong, and whether the answer is, for each.
        path: Image file.
    """
    bins = [b for b in np.array_split(np.array(sorted(answers), float), BIN_COUNT) if len(b)]
    stated, wrong = np.array([b.mean(axis=0) for b in bins]).T
    count = np.array([len(b) for b in bins])
    # A share of nothing or all still has an error: that of half an answer.
    error = np.sqrt(np.maximum(wrong * (1.0 - wrong), 0.25 / count) / count)
    figure, axes = figure_of(1, 1, (4.2, 4.2))
    axes.plot([0.0, 1.0], [0.0, 1.0], color="#7a7a7a", linewidth=1.0)
    axes.errorbar(stated, wrong, yerr=error, fmt="o", color="#d1495b")
    axes.set(xlabel="stated doubt", ylabel="share of answers that are wrong")
    axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), title=f"{len(answers)} pictures")
    save(figure, path)
