"""Link quality: rate and gaps of the packets of an arm."""

from __future__ import annotations

from collections import deque

from lariat.trajectory import SECOND

RATE_WINDOW = SECOND
"""Time over which rate and gaps are measured [ns]."""


class LinkQuality:
    """Times and numbers of the packets within the last second."""

    def __init__(self) -> None:
        self._arrivals: deque[tuple[int, int]] = deque()
        """Time [ns], and number of packets up to it."""
        self._gaps: deque[tuple[int, int]] = deque()
        """End and length of each gap that no later one exceeds [ns], the longest one first."""

    def update(self, received: int | None, count: int, now: int) -> None:
        """Advance to a time [ns], with the newest packet's and the number of packets up to it."""
        if received is not None and (not self._arrivals or received > self._arrivals[-1][0]):
            if self._arrivals:
                gap = received - self._arrivals[-1][0]
                while self._gaps and self._gaps[-1][1] <= gap:
                    self._gaps.pop()
                self._gaps.append((received, gap))
            self._arrivals.append((received, count))
        # One packet older than the window is kept, for a gap that reaches into the window.
        while len(self._arrivals) > 1 and now - self._arrivals[1][0] > RATE_WINDOW:
            self._arrivals.popleft()
        while self._gaps and self._gaps[0][0] <= self._arrivals[0][0]:
            self._gaps.popleft()

    def rate(self, now: int) -> float:
        """Return the packets within the last second [Hz], for the time of the last update."""
        if not self._arrivals:
            return 0.0
        time, before = self._arrivals[0]
        return float(self._arrivals[-1][1] - (before if now - time > RATE_WINDOW else 0))

    def gap(self, now: int) -> float:
        """Return the longest time without a packet within the last second, up to now [s]."""
        if not self._arrivals:
            return 0.0
        longest = self._gaps[0][1] if self._gaps else 0
        return 1e-9 * max(longest, now - self._arrivals[-1][0])
