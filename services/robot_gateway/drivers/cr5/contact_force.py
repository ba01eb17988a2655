"""Contact force at the gripper: the change of the measured force since the arm was armed at rest.

An arm without a force sensor infers the force from its motor currents, with an offset by its own
weight and friction. So the offset is measured at rest, and the difference is low-pass filtered.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.trajectory import NANOSECONDS, SECOND

OFFSET_TIME = 0.4
"""Time over which the offset is averaged [s]."""
FILTER_TIME_CONSTANT = 0.1
"""Time constant of the low-pass filter [s]."""


class ContactForce:
    """Force measurement relative to its offset at rest."""

    def __init__(self) -> None:
        self._samples: list[Float64[np.ndarray, "3"]] = []
        self._offset: Float64[np.ndarray, "3"] | None = None
        self._filtered = np.zeros(3)
        self._calibrating_since: int | None = None
        self._last_time = 0

    def calibrate(self) -> None:
        """Discard the offset and begin to average it anew."""
        self._samples, self._offset, self._calibrating_since = [], None, None

    @property
    def calibrated(self) -> bool:
        """Whether the offset is known."""
        return self._offset is not None

    def update(self, force: Float64[np.ndarray, "3"], now: int) -> None:
        """Take a measurement. Args: force: [N]. now: [ns]."""
        if self._offset is None:
            self._calibrating_since = (
                now if self._calibrating_since is None else self._calibrating_since
            )
            self._samples.append(force)
            if now - self._calibrating_since >= OFFSET_TIME * SECOND:
                self._offset, self._filtered = np.mean(self._samples, axis=0), np.zeros(3)
                self._samples = []
        else:
            gain = 1.0 - np.exp(-NANOSECONDS * (now - self._last_time) / FILTER_TIME_CONSTANT)
            self._filtered = self._filtered + gain * (force - self._offset - self._filtered)
        self._last_time = now

    @property
    def magnitude(self) -> float:
        """Magnitude of the filtered force [N]; 0 while the offset is not known."""
        return math.hypot(*self._filtered.tolist()) if self.calibrated else 0.0
