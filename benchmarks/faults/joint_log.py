"""Joint log of an emulated arm: times of braking and rest, and motion in between."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

LOG_PERIOD = 0.008
"""Time between rows [s]."""
SMOOTHING_TIME = 0.032
"""Width of the moving average of the speed: the time between servo points [s]."""
BRAKING_SPEED_FRACTION = 0.98
"""Fraction of the peak speed below which braking has begun."""
REST_SPEED = 0.01
"""Speed of the fastest joint below which an arm is at rest [rad/s]."""


@dataclass(frozen=True)
class JointLog:
    """Table of t rows of a log."""

    time: Float64[np.ndarray, "t"]
    """Time of each row [s]."""
    joints: Float64[np.ndarray, "t 6"]
    """Joint angles [rad]."""
    speed: Float64[np.ndarray, "t"]
    """Speed of the fastest joint [rad/s]."""

    @classmethod
    def read(cls, file: Path) -> JointLog:
        """Read all complete rows of a file."""
        lines = file.read_text(encoding="utf-8").splitlines()[1:]
        rows = [[float(v) for v in line.split(",")] for line in lines if line.count(",") == 13]
        table = np.array(rows).reshape(-1, 14)
        return cls(table[:, 0], table[:, 2:8], np.max(np.abs(table[:, 8:]), axis=1))

    def between(self, start: float, end: float) -> JointLog:
        """Return the rows between two times [s]."""
        chosen = (self.time >= start) & (self.time <= end)
        return JointLog(self.time[chosen], self.joints[chosen], self.speed[chosen])

    def braking_after(self, start: float, end: float) -> float | None:
        """Return the time from `start` until the arm is slower than its peak speed after it [s].

        None when it never moved; 0 when it was slowing down already.
        """
        width = round(SMOOTHING_TIME / LOG_PERIOD)
        part = self.between(start - 2.0 * SMOOTHING_TIME, end)
        if len(part.time) <= width or np.max(part.speed) < REST_SPEED:
            return None
        smooth = np.convolve(part.speed, np.ones(width) / width, mode="same")
        after = part.time >= start
        if np.max(smooth[after], initial=0.0) < REST_SPEED:
            return None
        peak = np.max(smooth[after], initial=0.0)
        fast = after & (smooth >= BRAKING_SPEED_FRACTION * peak)
        return max(float(part.time[fast][-1] - start), 0.0)

    def rest_after(self, start: float, end: float) -> float | None:
        """Return the time from `start` until the arm is at rest up to `end` [s], or None."""
        part = self.between(start, end)
        moving = np.nonzero(part.speed > REST_SPEED)[0]
        if not len(part.time) or (len(moving) and moving[-1] == len(part.time) - 1):
            return None
        return float(part.time[moving[-1]] - start) if len(moving) else 0.0

    def moved(self, start: float, end: float) -> float:
        """Return the largest angle by which a joint moved between two times [rad]."""
        part = self.between(start, end)
        return float(np.max(np.ptp(part.joints, axis=0))) if len(part.time) else 0.0
