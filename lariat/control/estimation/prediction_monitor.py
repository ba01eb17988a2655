"""Error of the controller's predictions, measured against the rope that is observed later."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.rope_observation import RopeObservation


@dataclass(frozen=True)
class PredictionSettings:
    """Averaging of the prediction error."""

    averaging_time: float = 0.3
    """Time constant of the mean square [s]."""
    max_plans: int = 64
    """Number of horizons that wait for an observation."""


class PredictionMonitor:
    """Compares the ends of horizons with observations of the same time."""

    def __init__(self, settings: PredictionSettings | None = None) -> None:
        """Create a monitor without predictions.

        Args:
            settings: Averaging.
        """
        self.settings = settings or PredictionSettings()
        self.begin_path()

    def begin_path(self) -> None:
        """Forget the errors on an earlier path."""
        self._mean_square = self._largest = 0.0
        self._observed_at: int | None = None
        self.drop_predictions()

    def drop_predictions(self) -> None:
        """Drop the predictions of motions that are not executed."""
        self._plans: deque[tuple[int, int, Float64[np.ndarray, "2 n 3"]]] = deque(
            maxlen=self.settings.max_plans
        )

    @property
    def deviation(self) -> float:
        """Root mean square node error at the end of a horizon, without the sensor's noise [m]."""
        return math.sqrt(self._mean_square)

    @property
    def max_deviation(self) -> float:
        """Largest deviation on the present path [m]."""
        return math.sqrt(self._largest)

    def take_plan(self, start: int, time_step: int, nodes: Float64[np.ndarray, "h n 3"]) -> None:
        """Take in a horizon.

        Args:
            start: Time at which it begins [ns].
            time_step: Duration of its steps [ns].
            nodes: Predicted nodes after each step [m].
        """
        if len(nodes) > 1:
            self._plans.append((start + len(nodes) * time_step, time_step, nodes[-2:]))

    def observe(self, rope: RopeObservation) -> None:
        """Compare an observation with the earliest horizon that ends after it."""
        while self._plans and self._plans[0][0] < rope.stamp:
            self._plans.popleft()
        if not self._plans or not np.any(rope.observed):
            return
        end, time_step, (before, last) = self._plans[0]
        share = (end - rope.stamp) / time_step
        if share > 1.0:
            return
        missed = (share * before + (1.0 - share) * last - rope.nodes)[rope.observed]
        noise = 3.0 * float(np.mean(rope.sigma[rope.observed] ** 2))
        square = max(float(np.mean(np.sum(missed**2, axis=1))) - noise, 0.0)
        elapsed = 0.0 if self._observed_at is None else 1e-9 * (rope.stamp - self._observed_at)
        self._observed_at = rope.stamp
        gain = 1.0 - math.exp(-elapsed / self.settings.averaging_time)
        self._mean_square += gain * (square - self._mean_square)
        self._largest = max(self._largest, self._mean_square)
