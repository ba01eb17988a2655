"""Orderly shutdown of a live gateway: arms brake and are disabled, then the links are closed."""

from __future__ import annotations

import time

from lariat.trajectory import NANOSECONDS
from services.robot_gateway.cell import Cell
from shared.runtime.clock import Clock

BRAKING_TIMEOUT = 1.2
"""Longest time to brake and to disable [s]; the launcher kills a service that takes longer."""


def bring_to_rest(cell: Cell, clock: Clock) -> None:
    """Disarm a cell and step it until its arms report that their drives are off."""
    period = cell.watchdog.settings.period
    cell.disarm()
    begun = clock.now()
    while (clock.now() - begun) * NANOSECONDS < BRAKING_TIMEOUT:
        cell.step(clock.now())
        if cell.follower.resting and not cell.arms.powered:
            break
        time.sleep(period)
