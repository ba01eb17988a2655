"""Recent commands, by which the deviation of an arm that follows them with a delay is measured."""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.trajectory import NANOSECONDS, MotionState

MAX_LAG = 0.25
"""Largest delay with which an arm may follow its command [s]; older commands are forgotten."""
LEVER_ARM = 0.1
"""Lever arm that converts a rotation of a grip into a displacement of its bodies [m]."""


class CommandHistory:
    """Commanded poses of the driven grips within the last `MAX_LAG`."""

    def __init__(self) -> None:
        self._times: deque[int] = deque()
        """Times of the commands [ns]."""
        self._poses = np.zeros((0, 0, 7))
        """Positions and orientations of the grips; the commands end before row `_end`."""
        self._end = 0

    def add(self, now: int, state: MotionState) -> None:
        """Add the command at a time [ns]."""
        if self._end == len(self._poses):
            kept, self._end = self._recent, len(self._times)
            self._poses = np.empty((2 * self._end + 64, len(state.positions), 7))
            if self._end:
                self._poses[: self._end] = kept
        row = self._poses[self._end]
        row[:, :3], row[:, 3:] = state.positions, state.orientations
        self._end += 1
        self._times.append(now)
        while (now - self._times[0]) * NANOSECONDS > MAX_LAG:
            self._times.popleft()

    def clear(self) -> None:
        """Forget every command."""
        self._times.clear()

    def error(self, driven: int, pose: Pose) -> tuple[float, float]:
        """Return distance and angle of a grip from the nearest recent command [m, rad].

        Args:
            driven: Index of the grip among the driven ones.
            pose: Its measured pose.
        """
        if not self._times:
            return 0.0, 0.0
        recent = self._recent[:, driven]
        gaps = recent[:, :3] - pose.position
        distances = np.sqrt(np.einsum("ij,ij->i", gaps, gaps))
        # q and -q are the same rotation.
        cosines = np.abs(recent[:, 3:] @ pose.orientation)
        angles = 2.0 * np.arccos(np.minimum(cosines, 1.0))
        nearest = int(np.argmin(distances + LEVER_ARM * angles))
        return float(distances[nearest]), float(angles[nearest])

    @property
    def _recent(self) -> Float64[np.ndarray, "m k 7"]:
        """Positions and orientations of the commands, the oldest first."""
        return self._poses[self._end - len(self._times) : self._end]
