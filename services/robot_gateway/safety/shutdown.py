"""The orderly end of a live gateway: arms brake, then lose their power, then the line is closed."""

from __future__ import annotations

import time

from services.robot_gateway.cell import TICK, Cell
from shared.clock import Clock

PATIENCE = 0.7
"""Longest time to brake and to disable [s]; whoever ends a service waits for one second."""
FAREWELL = 0.05
"""For the last commands to leave [s]."""


def bring_to_rest(cell: Cell, clock: Clock) -> None:
    """Disarms the cell and steps it until nothing moves."""
    cell.disarm()
    begun = clock.now()
    while (clock.now() - begun) * 1e-9 < PATIENCE:
        cell.step(clock.now())
        if cell.guidance.resting and not cell.arms.powered:
            break
        time.sleep(TICK)
    ended = clock.now() + round(FAREWELL * 1e9)
    while clock.now() < ended:
        cell.step(clock.now())
        time.sleep(TICK)
