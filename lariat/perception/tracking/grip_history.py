"""Poses of both grips at past times, interpolated between arm states."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque

from lariat.geometry import poses
from lariat.geometry.poses import Pose

MAX_ARM_STATES = 200
"""Number of arm states that are kept; at 125 Hz they span 1.6 s."""
CLOCK_RESET_STEP = 1_000_000_000
"""Backward step of the stamps above which they come from a restarted gateway, with another clock
[ns]."""


class GripHistory:
    """Ring buffer of stamped grip poses."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Pose, Pose]] = deque(maxlen=MAX_ARM_STATES)

    def add(self, stamp: int, left: Pose, right: Pose) -> None:
        """Append the poses at a stamp [ns]; a restarted clock clears the history, an older stamp is
        ignored."""
        if not self._samples or stamp > self._samples[-1][0]:
            self._samples.append((stamp, left, right))
        elif stamp < self._samples[-1][0] - CLOCK_RESET_STEP:
            self._samples.clear()

    def at(self, stamp: int) -> tuple[Pose | None, Pose | None]:
        """Left and right grip at a stamp [ns], the nearest known ones outside the history."""
        if not self._samples:
            return None, None
        index = bisect_left(self._samples, stamp, key=lambda row: row[0])
        if index == 0 or index == len(self._samples):
            _, left, right = self._samples[min(index, len(self._samples) - 1)]
            return left, right
        (t0, *before), (t1, *after) = self._samples[index - 1], self._samples[index]
        share = (stamp - t0) / (t1 - t0)
        left, right = (poses.interpolate(a, b, share) for a, b in zip(before, after, strict=True))
        return left, right
