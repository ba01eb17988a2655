"""A packet that tells of a jump no arm can make is not believed until another one says the same."""

from __future__ import annotations

import numpy as np

JOINT_SPEED = 360.0
"""Twice what a joint can do [deg/s]."""
SPEED = 6000.0
"""Of the flange, far above what it can do [mm/s]."""
SPARE = (2.0, 20.0)
"""Allowed at any time: joints [deg], flange [mm]."""


class Outliers:
    """Compares each packet with the one before it, believed or not."""

    def __init__(self) -> None:
        self._before: tuple[int, np.ndarray] | None = None

    def believes(self, packet: np.ndarray, now: int) -> bool:
        """Whether a packet that came at `now` [ns] goes on from the one before it."""
        before, self._before = self._before, (now, packet)
        if before is None:
            return True
        then, other = before
        seconds = min(max((now - then) * 1e-9, 0.008), 1.0)
        joints = np.max(np.abs(packet["q_actual"] - other["q_actual"]))
        moved = np.linalg.norm(packet["tool_vector_actual"][:3] - other["tool_vector_actual"][:3])
        near = joints <= SPARE[0] + JOINT_SPEED * seconds
        return bool(near and moved <= SPARE[1] + SPEED * seconds)
