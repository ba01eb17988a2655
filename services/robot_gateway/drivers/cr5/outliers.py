"""Outlier rejection: a packet with an impossible jump counts only once the next one confirms it."""

from __future__ import annotations

import math

import numpy as np

JOINT_SPEED_LIMIT = 360.0
"""Joint speed above which a change is a jump: twice the maximum [deg/s]."""
FLANGE_SPEED_LIMIT = 6000.0
"""Speed of the flange above which a change is a jump, far above the maximum [mm/s]."""
JOINT_TOLERANCE = 2.0
"""Change of a joint that is accepted at any time [deg]."""
FLANGE_TOLERANCE = 20.0
"""Displacement of the flange that is accepted at any time [mm]."""
PACKET_INTERVALS = (0.008, 1.0)
"""Least and largest time that counts as passed between two packets [s]."""


class OutlierFilter:
    """Compares each packet with the one before it, accepted or not."""

    def __init__(self) -> None:
        self._before: tuple[int, np.ndarray] | None = None

    def accepts(self, packet: np.ndarray, now: int) -> bool:
        """Whether a packet, received at `now` [ns], is consistent with the one before it."""
        before, self._before = self._before, (now, packet)
        if before is None:
            return True
        then, other = before
        shortest, longest = PACKET_INTERVALS
        seconds = min(max((now - then) * 1e-9, shortest), longest)
        joints, moved = (
            [a - b for a, b in zip(packet[name].tolist(), other[name].tolist(), strict=True)]
            for name in ("q_actual", "tool_vector_actual")
        )
        step = JOINT_TOLERANCE + JOINT_SPEED_LIMIT * seconds
        joints_fit = all(-step <= joint <= step for joint in joints)
        reach = FLANGE_TOLERANCE + FLANGE_SPEED_LIMIT * seconds
        return joints_fit and math.hypot(*moved[:3]) <= reach
