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


class SimulatedClock:
    """Clock that its owner advances."""

    def __init__(self, start: int = 0) -> None:
        self._now = start

    def now(self) -> int:
        """Return the time set last [ns]."""
        return self._now

    def advance_to(self, instant: int) -> None:
        """Set the time.

        Args:
            instant: New time [ns].

        Raises:
            ValueError: The instant lies before the present time.
        """
        if instant < self._now:
            raise ValueError(f"time cannot go back from {self._now} ns to {instant} ns")
        self._now = instant
