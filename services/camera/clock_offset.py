"""Offset of a device's clock, estimated from the arrival times of its exposures.

An exposure arrives after a delay with a known minimum. The least difference of arrival
time and device time is the offset of the clocks plus that minimum. Clocks drift, so old differences
are dropped.
"""

from __future__ import annotations

from collections import deque

MAX_DIFFERENCE_AGE = 10_000_000_000
"""Age above which a difference is dropped [ns]."""
MAX_JUMP = 500_000_000
"""Jump of a device's clock above which the device counts as restarted [ns]."""


class ClockOffset:
    """Estimate of the offset between the cell's clock and a device's."""

    def __init__(self, delay: int = 0) -> None:
        """Start without an estimate; `delay` is the least time from exposure to arrival [ns]."""
        self._delay = delay
        # Arrival times and differences, increasing in both: only a difference that is less than all
        # later ones can become the least.
        self._candidates: deque[tuple[int, int]] = deque()
        self._last_difference: int | None = None

    @property
    def offset(self) -> int | None:
        """Cell's time minus device's time [ns]; None before the first exposure."""
        return self._candidates[0][1] - self._delay if self._candidates else None

    def stamp(self, exposed: int, arrived: int) -> int:
        """Return the time of an exposure by the clock of its arrival, the cell's [ns]."""
        difference = arrived - exposed
        if self._last_difference is not None and abs(difference - self._last_difference) > MAX_JUMP:
            self._candidates.clear()
        self._last_difference = difference
        while self._candidates and self._candidates[-1][1] >= difference:
            self._candidates.pop()
        self._candidates.append((arrived, difference))
        while arrived - self._candidates[0][0] > MAX_DIFFERENCE_AGE:
            self._candidates.popleft()
        # Never in the future, whatever the clocks say.
        return min(exposed + self._candidates[0][1] - self._delay, arrived)
