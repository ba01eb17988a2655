"""Stated doubt of followed chains against the share of them that are wrong."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from benchmarks.perception.instances.calibration import fit_logistic

BOUNDS = (0.0, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Bounds of the groups of stated doubt [-]."""


class StatedDoubt(NamedTuple):
    """Doubt of one chain."""

    doubt: float
    """Stated probability that it is wrong [-]."""
    wrong: bool
    """Whether a visible node of it is off by more than a centimetre."""
    features: tuple[float, ...]
    """Features of the model that the probability comes from."""


def reliability(doubts: Sequence[StatedDoubt]) -> list[dict[str, float | str]]:
    """Return, for each group of stated doubt, its chains, the mean doubt and the wrong share."""
    stated = np.array([d.doubt for d in doubts])
    wrong = np.array([d.wrong for d in doubts])
    rows: list[dict[str, float | str]] = []
    for low, high in pairwise(BOUNDS):
        group = (stated >= low) & ((stated < high) | (high == BOUNDS[-1]))
        if np.any(group):
            rows.append(
                {
                    "stated, %": f"{100.0 * low:g} to {100.0 * high:g}",
                    "chains": int(np.sum(group)),
                    "mean stated, %": 100.0 * float(np.mean(stated[group])),
                    "wrong, %": 100.0 * float(np.mean(wrong[group])),
                }
            )
    return rows


def fitted(doubts: Sequence[StatedDoubt]) -> tuple[float, ...]:
    """Return the coefficients of the model, fitted to what was wrong."""
    features = np.array([d.features for d in doubts])
    return fit_logistic(features, np.array([d.wrong for d in doubts]))
