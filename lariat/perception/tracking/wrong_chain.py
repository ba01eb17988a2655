"""Probability that a chain leaves the held rope, from its inconsistencies with the images.

An inconsistency tells how badly chain and image agree, not how often such a chain is wrong. A
logistic model of the inconsistency in this image, and of the largest one in the images before,
does. Its coefficients are fitted by `lariat bench perception following --fit` to sequences that
nothing else was tuned on."""

from __future__ import annotations

import math

import numpy as np

DECAY_TIME = 1.0
"""Time in which an earlier inconsistency counts e times less [s]."""
MAX_INCONSISTENCY = 1.0
"""Inconsistency above which a chain is as wrong as it can be [-]."""
LEAST_INCONSISTENCY = 0.02
"""Inconsistency that noise makes [-]."""
COEFFICIENTS = (1.28, 1.332, 0.801)
"""Intercept, and one coefficient for each feature."""


class WrongChainModel:
    """Doubt of successive chains of one camera."""

    def __init__(self) -> None:
        self.features = (0.0, 0.0)
        """Features of the newest chain."""
        self._recent: float | None = None
        self._stamp = 0

    def forget(self) -> None:
        """Drop the inconsistencies of earlier images: the next chain does not continue them."""
        self._recent = None

    def take(self, inconsistency: float, stamp: int) -> float:
        """Return the probability that some visible node lies off the rope by over a centimetre.

        Args:
            inconsistency: Inconsistency of chain and image, `CenterlineEstimate.inconsistency` [-].
            stamp: Time of the exposure [ns].
        """
        now = min(inconsistency, MAX_INCONSISTENCY)
        decay = math.exp(-max(stamp - self._stamp, 0) / 1e9 / DECAY_TIME)
        before = now if self._recent is None else self._recent * decay
        self._recent, self._stamp = max(now, before), stamp
        self.features = math.log(now + LEAST_INCONSISTENCY), math.log(before + LEAST_INCONSISTENCY)
        intercept, *slopes = COEFFICIENTS
        return float(1.0 / (1.0 + np.exp(-(intercept + np.dot(slopes, self.features)))))
