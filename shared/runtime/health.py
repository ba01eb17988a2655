"""Health of a live service: step times, overruns and age of its inputs."""

from __future__ import annotations

import math
from collections.abc import Mapping

from shared.messages import Health


class HealthMeter:
    """Meter of a service's steps: counts since the start, durations since the last report."""

    def __init__(self, period: float) -> None:
        self._period = 1e9 * period
        self._durations: list[int] = []
        self.steps = 0
        """Number of steps."""
        self.overruns = 0
        """Number of steps that lasted longer than the period."""

    def add(self, duration: int) -> None:
        """Add one step."""
        self.steps += 1
        self.overruns += duration > self._period
        self._durations.append(duration)

    def report(self, input_ages: Mapping[str, int]) -> Health:
        """Return a health message, and start a new period of reporting.

        The caller fills in the name of the service and what else it knows.
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
    """Smallest of the values that at least this fraction of them does not exceed."""
    return ordered[max(0, math.ceil(fraction * len(ordered)) - 1)]
