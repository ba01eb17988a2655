"""Link quality: rate and gaps of the packets of an arm."""

from __future__ import annotations

from collections import deque
from itertools import pairwise

from shared.service import SECOND

RATE_WINDOW = SECOND
"""Time over which rate and gaps are measured [ns]."""


class LinkQuality:
    """Times of the packets within the last second."""

    def __init__(self) -> None:
        self._times: deque[int] = deque()

    def update(self, received: int | None, now: int) -> None:
        """Advance to `now` [ns]. Args: received: Time of the newest packet [ns]."""
        if received is not None and (not self._times or received > self._times[-1]):
            self._times.append(received)
        # One packet older than the window is kept, for a gap that reaches into the window.
        while len(self._times) > 1 and now - self._times[1] > RATE_WINDOW:
            self._times.popleft()

    def rate(self, now: int) -> float:
        """Return the packets within the last second [Hz]."""
        return float(sum(now - time <= RATE_WINDOW for time in self._times))

    def gap(self, now: int) -> float:
        """Return the longest time without a packet within the last second, up to now [s]."""
        if not self._times:
            return 0.0
        times = [*self._times, now]
        return 1e-9 * max(b - a for a, b in pairwise(times))
