"""Orderly shutdown of a live gateway: arms brake and are disabled, then the links are closed."""

from __future__ import annotations

import time

from lariat.trajectory import NANOSECONDS
from services.robot_gateway.cell import Cell
from shared.clock import Clock

BRAKING_TIMEOUT = 0.7
"""Longest time to brake and to disable [s]; the launcher waits one second for a service to end."""
FLUSH_TIME = 0.05
"""Time for the last commands to leave [s]."""


def bring_to_rest(cell: Cell, clock: Clock) -> None:
    """Disarm a cell and step it until nothing moves."""
    period = cell.watchdog.settings.period
    cell.disarm()
    begun = clock.now()
    while (clock.now() - begun) * NANOSECONDS < BRAKING_TIMEOUT:
        cell.step(clock.now())
        if cell.follower.resting and not cell.arms.powered:
            break
        time.sleep(period)
    ended = clock.now() + round(FLUSH_TIME / NANOSECONDS)
    while clock.now() < ended:
        cell.step(clock.now())
        time.sleep(period)
