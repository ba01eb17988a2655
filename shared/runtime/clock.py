"""Clocks, which give the time in integer nanoseconds."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Source of the time."""

    def now(self) -> int:
        """Return the time since 1970, or since the start of simulated time [ns]."""
        ...


class SystemClock:
    """Time of the machine, which never jumps back within a process.

    It starts at the wall clock's time, so that stamps of several processes are comparable, and then
    follows the monotonic clock.
    """

    def __init__(self) -> None:
        self._offset = time.time_ns() - time.monotonic_ns()

    def now(self) -> int:
        """Return the time since 1970 [ns]."""
        return self._offset + time.monotonic_ns()
