"""Time in integer nanoseconds."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Says what time it is."""

    def now(self) -> int:
        """Nanoseconds since 1970, or since the start in simulated time."""
        ...


class SystemClock:
    """The machine's time, which never jumps back within a process.

    It starts at the wall clock, so that stamps of several processes compare, and then follows the
    monotonic one.
    """

    def __init__(self) -> None:
        self._offset = time.time_ns() - time.monotonic_ns()

    def now(self) -> int:
        return self._offset + time.monotonic_ns()


class SimulatedClock:
    """Time that its owner sets."""

    def __init__(self, start: int = 0) -> None:
        self._now = start

    def now(self) -> int:
        return self._now

    def advance_to(self, instant: int) -> None:
        """Sets the time, which may not go back [ns]."""
        if instant < self._now:
            raise ValueError(f"time cannot go back from {self._now} ns to {instant} ns")
        self._now = instant
