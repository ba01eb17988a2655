"""How well an arm is heard: how often, and with what gaps."""

from __future__ import annotations

from collections import deque
from itertools import pairwise

WINDOW = 1_000_000_000
"""Over which it is judged [ns]."""


class LinkQuality:
    """Times at which an arm was heard within the last second."""

    def __init__(self) -> None:
        self._heard: deque[int] = deque()

    def take(self, heard: int | None, now: int) -> None:
        """One tick. Args: heard: When the arm was last heard [ns]. now: [ns]."""
        if heard is not None and (not self._heard or heard > self._heard[-1]):
            self._heard.append(heard)
        # One older than the window stays, so that a gap that reaches into it is seen.
        while len(self._heard) > 1 and now - self._heard[1] > WINDOW:
            self._heard.popleft()

    def rate(self, now: int) -> float:
        """Of what was heard within the last second [Hz]."""
        return float(sum(now - heard <= WINDOW for heard in self._heard))

    def gap(self, now: int) -> float:
        """Longest time without a word within the last second, up to now [s]."""
        if not self._heard:
            return 0.0
        times = [*self._heard, now]
        return 1e-9 * max(b - a for a, b in pairwise(times))
