"""Processor time of one plan, and its limit."""

from __future__ import annotations

import time
from collections.abc import Callable


class PlanningTime:
    """Processor time since the beginning of a plan; when it is over, no further search is begun."""

    def __init__(self, limit: float, clock: Callable[[], float] = time.process_time) -> None:
        """Begin to count.

        Args:
            limit: Processor time that a plan may take [s].
            clock: Processor time of this process [s].
        """
        self._limit, self._clock = limit, clock
        self._began = clock()
        self.cut = False
        """Whether a search was left out because the time was over."""

    def is_over(self) -> bool:
        """Return whether the time is over; asked before every search that is left out then."""
        over = self._clock() - self._began > self._limit
        self.cut = self.cut or over
        return over
