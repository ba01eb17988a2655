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
        self._latest: tuple[np.ndarray, np.ndarray] | None = None
        """Positions and orientations of all rows, laid side by side when they are asked for."""

    def add(self, now: int, state: MotionState) -> None:
        """Add the command at a time [ns]."""
        self._rows.append((now, state))
        self._latest = None
        while (now - self._rows[0][0]) * NANOSECONDS > MAX_LAG:
            self._rows.popleft()

    def clear(self) -> None:
        """Forget every command."""
        self._rows.clear()
        self._latest = None

    def error(self, driven: int, pose: Pose) -> tuple[float, float]:
        """Return distance and angle of a grip from the nearest recent command [m, rad].

        Args:
            driven: Index of the grip among the driven ones.
            pose: Its measured pose.
        """
        if not self._rows:
            return 0.0, 0.0
        if self._latest is None:
            states = [state for _, state in self._rows]
            self._latest = (
                np.array([state.positions for state in states]),
                np.array([state.orientations for state in states]),
            )
        gaps = self._latest[0][:, driven] - pose.position
        distances = np.sqrt(np.einsum("ij,ij->i", gaps, gaps))
        # q and -q are the same rotation.
        cosines = np.abs(self._latest[1][:, driven] @ pose.orientation)
        angles = 2.0 * np.arccos(np.minimum(cosines, 1.0))
        nearest = int(np.argmin(distances + LEVER_ARM * angles))
        return float(distances[nearest]), float(angles[nearest])
