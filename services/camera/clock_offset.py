"""What time a device's clock shows, measured by when its exposures arrive.

An exposure arrives some time after it was made, sometimes later, never earlier. The least
difference of arrival and device time within a while is the clocks' offset plus the least delay,
which is known of a camera. Clocks drift, so the least difference of long ago is forgotten.
"""

from __future__ import annotations

from collections import deque

WINDOW = 10_000_000_000
"""Differences older than this are forgotten [ns]."""
JUMP = 500_000_000
"""A device whose clock jumps by more has been restarted [ns]."""


class ClockOffset:
    """Follows one device's clock."""

    def __init__(self, delay: int = 0) -> None:
        """
        Args:
            delay: Least time from exposure to arrival [ns].
        """
        self._delay = delay
        # Increasing in both columns: only a difference that is less than all later ones may
        # become the least.
        self._least: deque[tuple[int, int]] = deque()
        self._last: int | None = None

    @property
    def offset(self) -> int | None:
        """Cell's time minus device's [ns]; None before the first exposure."""
        return self._least[0][1] - self._delay if self._least else None

    def stamp(self, exposed: int, arrived: int) -> int:
        """When an exposure was made, by the cell's clock [ns].

        Args:
            exposed: By the device's clock [ns].
            arrived: By the cell's clock [ns].
        """
        difference = arrived - exposed
        if self._last is not None and abs(difference - self._last) > JUMP:
            self._least.clear()
        self._last = difference
        while self._least and self._least[-1][1] >= difference:
            self._least.pop()
        self._least.append((arrived, difference))
        while arrived - self._least[0][0] > WINDOW:
            self._least.popleft()
        # An exposure is never of the future, whatever the clocks say.
        return min(exposed + self._least[0][1] - self._delay, arrived)
