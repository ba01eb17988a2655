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
COEFFICIENTS = (-1.219, 0.242, 1.124)
"""Intercept, and one coefficient for each feature."""


class WrongChainModel:
    """Doubt of successive chains of one camera."""

    def __init__(self) -> None:
        self._recent, self._stamp = 0.0, 0

    def forget(self) -> None:
        """Drop the inconsistencies of earlier images."""
        self._recent = 0.0

    def take(self, inconsistency: float, stamp: int) -> float:
        """Return the probability that some visible node lies off the rope by over a centimetre.

        Args:
            inconsistency: Inconsistency of chain and image, `CenterlineEstimate.inconsistency` [-].
            stamp: Time of the exposure [ns].
        """
        features = self.features(inconsistency, stamp)
        intercept, *slopes = COEFFICIENTS
        return float(1.0 / (1.0 + np.exp(-(intercept + np.dot(slopes, features)))))

    def features(self, inconsistency: float, stamp: int) -> tuple[float, float]:
        """Return the features of the model, and remember the inconsistency.

        Args:
            inconsistency: Inconsistency of chain and image [-].
            stamp: Time of the exposure [ns].
        """
        now = min(inconsistency, MAX_INCONSISTENCY)
        elapsed = max(stamp - self._stamp, 0) / 1e9
        before = self._recent * math.exp(-elapsed / DECAY_TIME)
        self._recent, self._stamp = max(now, before), stamp
        return math.log(now + LEAST_INCONSISTENCY), math.log(before + LEAST_INCONSISTENCY)
