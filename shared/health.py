"""How a live service fares: step times, overruns, drops, age of its inputs."""

from __future__ import annotations

import math
from collections.abc import Mapping

from shared.messages import Health


class HealthMeter:
    """Counts since the start; step times since the last report."""

    def __init__(self, period: float) -> None:
        self._period = 1e9 * period
        self._durations: list[int] = []
        self.steps = 0
        self.overruns = 0
        """Steps that lasted longer than the period."""

    def add(self, duration: int) -> None:
        """Takes the duration of one step [ns]."""
        self.steps += 1
        self.overruns += duration > self._period
        self._durations.append(duration)

    def report(self, input_ages: Mapping[str, int]) -> Health:
        """What happened since the last report.

        Args:
            input_ages: Time since the newest message of each topic came [ns].
        """
        durations = sorted(self._durations) or [0]
        self._durations = []
        return Health(
            period_ms=1e-6 * self._period,
            step_p50_ms=1e-6 * _quantile(durations, 0.50),
            step_p99_ms=1e-6 * _quantile(durations, 0.99),
            step_max_ms=1e-6 * durations[-1],
            steps=self.steps,
            overruns=self.overruns,
            input_age_ms={key: 1e-6 * age for key, age in input_ages.items()},
        )


def _quantile(ordered: list[int], fraction: float) -> int:
    """The smallest value that at least this fraction of the values does not exceed."""
    return ordered[max(0, math.ceil(fraction * len(ordered)) - 1)]
