"""Numbers over time, bounded in memory however long a run lasts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64


class History:
    """Rows of (time, values…), thinned evenly when there are too many."""

    def __init__(self, width: int, capacity: int = 2000) -> None:
        """Args:
        width: Values beside the time.
        capacity: Most rows; beyond, every other row goes and the spacing doubles.
        """
        self._rows = np.zeros((capacity, 1 + width))
        self._count = 0
        self._spacing = 0.0

    def __len__(self) -> int:
        return self._count

    def clear(self) -> None:
        """Forgets everything."""
        self._count, self._spacing = 0, 0.0

    def add(self, time: float, *values: float) -> bool:
        """Takes one row [s, …], unless it follows the last one too closely; says whether."""
        if self._count:
            last = self._rows[self._count - 1, 0]
            if time <= last or time - last < self._spacing:
                return False
        if self._count == len(self._rows):
            half = self._rows[::2].copy()
            self._count = len(half)
            self._rows[: self._count] = half
            # Slightly less than the mean spacing, or jitter would halve the rate once more.
            self._spacing = 0.9 * (half[-1, 0] - half[0, 0]) / (self._count - 1)
        self._rows[self._count] = time, *values
        self._count += 1
        return True

    @property
    def columns(self) -> tuple[Float64[np.ndarray, "n"], ...]:
        """Time and every value, one array each."""
        return tuple(column.copy() for column in self._rows[: self._count].T)
