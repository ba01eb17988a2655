"""Recent commands, by which the deviation of an arm that follows them with a delay is measured."""

from __future__ import annotations

from collections import deque

import numpy as np

from lariat.geometry.poses import Pose
from lariat.trajectory import NANOSECONDS, MotionState

MAX_LAG = 0.25
"""Largest delay with which an arm may follow its command [s]; older commands are forgotten."""
LEVER_ARM = 0.1
"""Lever arm that converts a rotation of a grip into a displacement of its bodies [m]."""


class CommandHistory:
    """Commanded poses of the driven grips within the last `MAX_LAG`."""

    def __init__(self) -> None:
        self._rows: deque[tuple[int, MotionState]] = deque()

    def add(self, now: int, state: MotionState) -> None:
        """Add the command at a time [ns]."""
        self._rows.append((now, state))
        while (now - self._rows[0][0]) * NANOSECONDS > MAX_LAG:
            self._rows.popleft()

    def clear(self) -> None:
        """Forget every command."""
        self._rows.clear()

    def error(self, driven: int, pose: Pose) -> tuple[float, float]:
        """Return distance and angle of a grip from the nearest recent command [m, rad].

        Args:
            driven: Index of the grip among the driven ones.
            pose: Its measured pose.
        """
        if not self._rows:
            return 0.0, 0.0
        positions = np.array([state.positions[driven] for _, state in self._rows])
        orientations = np.array([state.orientations[driven] for _, state in self._rows])
        distances = np.linalg.norm(positions - pose.position, axis=1)
        # q and -q are the same rotation.
        angles = 2.0 * np.arccos(np.minimum(np.abs(orientations @ pose.orientation), 1.0))
        nearest = int(np.argmin(distances + LEVER_ARM * angles))
        return float(distances[nearest]), float(angles[nearest])
