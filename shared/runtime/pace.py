"""Pace of a service's steps in real time: an absolute schedule, which messages may anticipate.

A step that a message begins takes the place of the next one of the schedule, so that messages do
not raise the rate. The step after it keeps whole periods from it: periodic messages then do not
come while a scheduled step is under way.
"""

from __future__ import annotations

MIN_PERIOD_SHARE = 0.25
"""Least time between two steps that messages begin [periods]."""
MAX_PERIODS = 2
"""Longest time from a step that a message begins to the next one of the schedule [periods]."""


class Pace:
    """Instants at which the steps of a service begin, all in [ns] of one monotonic clock."""

    def __init__(self, period: int, now: int) -> None:
        """Create the pace of a service whose first step begins now."""
        self._period = period
        self._slot = now
        """Instant of the schedule that the present step uses up."""
        self._anticipated: int | None = None
        """Beginning of the last step that a message began."""

    def deadline(self, began: int, now: int, *, woken: bool) -> int:
        """Return when the next step is due if no message begins one before.

        Steps of the schedule that were missed meanwhile are skipped.
        """
        period = self._period
        self._slot += period * max(1, -(-(now - self._slot) // period))
        if not woken:
            return self._slot
        self._anticipated = began
        # Messages may be more frequent than the schedule.
        self._slot = min(self._slot, began + MAX_PERIODS * period)
        return began + period * max(1, round((self._slot - began) / period))

    def earliest(self, now: int) -> int:
        """Return when the step of a message that has come can begin."""
        if self._anticipated is None:
            return now
        return max(now, self._anticipated + round(MIN_PERIOD_SHARE * self._period))
