"""What an arm did after a fault, from its own log of its joints."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

SPACING = 0.032
"""Between servo points [s]: a mean over it takes their steps out of the speed."""
AT_PEAK = 0.98
"""Share of the greatest speed from which braking has begun."""
RESTING = 0.01
"""Speed of the fastest joint below which an arm rests [rad/s]."""


@dataclass(frozen=True)
class JointLog:
    """Rows of an emulator's log."""

    time: Float64[np.ndarray, "t"]
    """[s]"""
    joints: Float64[np.ndarray, "t 6"]
    """[rad]"""
    speed: Float64[np.ndarray, "t"]
    """Of the fastest joint [rad/s]."""

    @classmethod
    def read(cls, file: Path) -> JointLog:
        """All whole rows."""
        lines = file.read_text(encoding="utf-8").splitlines()[1:]
        rows = [[float(v) for v in line.split(",")] for line in lines if line.count(",") == 13]
        table = np.array(rows).reshape(-1, 14)
        return cls(table[:, 0], table[:, 2:8], np.max(np.abs(table[:, 8:]), axis=1))

    def between(self, start: float, end: float) -> JointLog:
        """The rows of a time [s]."""
        chosen = (self.time >= start) & (self.time <= end)
        return JointLog(self.time[chosen], self.joints[chosen], self.speed[chosen])

    def braking_after(self, start: float, end: float) -> float | None:
        """From `start` until the arm is slower than its greatest speed after that [s].

        None when it never moved; an arm that slowed down already counts as braking at once.
        """
        width = round(SPACING / 0.008)
        part = self.between(start - 2.0 * SPACING, end)
        if len(part.time) <= width or np.max(part.speed) < RESTING:
            return None
        smooth = np.convolve(part.speed, np.ones(width) / width, mode="same")
        after = part.time >= start
        if np.max(smooth[after], initial=0.0) < RESTING:
            return None
        fast = after & (smooth >= AT_PEAK * np.max(smooth[after], initial=0.0))
        return max(float(part.time[fast][-1] - start), 0.0)

    def rest_after(self, start: float, end: float) -> float | None:
        """From `start` until the arm rests and stays at rest up to `end` [s]; None when not."""
        part = self.between(start, end)
        moving = np.nonzero(part.speed > RESTING)[0]
        if not len(part.time) or (len(moving) and moving[-1] == len(part.time) - 1):
            return None
        return float(part.time[moving[-1]] - start) if len(moving) else 0.0

    def moved(self, start: float, end: float) -> float:
        """Greatest angle by which a joint moved within a time [rad]."""
        part = self.between(start, end)
        return float(np.max(np.ptp(part.joints, axis=0))) if len(part.time) else 0.0
