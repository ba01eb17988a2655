"""Watchdog: age of the setpoints, and of the gateway's own last tick."""

from __future__ import annotations

from dataclasses import dataclass

from lariat.trajectory import NANOSECONDS


@dataclass(frozen=True)
class WatchdogSettings:
    """Time limits of the watchdog."""

    period: float = 0.008
    """Period of the gateway [s]."""
    brake_age: float = 0.05
    """Age of the last fresh chunk at which the command brakes, without holding yet [s]. An arm
    follows its command some 80 ms later and must begin to brake within 150 ms."""
    hold_age: float = 0.1
    """Age of the last fresh chunk or of the last tick at which the cell holds for a person [s]."""


class Watchdog:
    """Times of the last fresh chunk and of the last tick."""

    def __init__(self, settings: WatchdogSettings | None = None) -> None:
        """Create a watchdog before the first tick. Args: settings: Time limits."""
        self.settings = settings or WatchdogSettings()
        self._last_fresh = 0
        self._last_tick: int | None = None

    def feed(self, now: int) -> None:
        """Note that the writer is alive at a time [ns]."""
        self._last_fresh = max(self._last_fresh, now)

    def tick(self, now: int) -> None:
        """Note a tick of the gateway at a time [ns]."""
        self._last_tick = now

    def elapsed(self, now: int) -> float:
        """Return the time since the last tick, or one period before the first tick [s]."""
        if self._last_tick is None:
            return self.settings.period
        return (now - self._last_tick) * NANOSECONDS

    def stalled(self, now: int) -> bool:
        """Return whether the last tick is so old that the gateway must have been suspended."""
        return self.elapsed(now) > self.settings.hold_age

    def must_brake(self, now: int, h: float) -> bool:
        """Return whether the setpoints are too old to be followed for another `h` [s]."""
        return self._age(now, h) > self.settings.brake_age

    def must_hold(self, now: int, h: float) -> bool:
        """Return whether the setpoints will be so old in `h` [s] that the cell holds."""
        return self._age(now, h) > self.settings.hold_age

    def _age(self, now: int, h: float) -> float:
        return (now - self._last_fresh) * NANOSECONDS + h
