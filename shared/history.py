"""Time series of bounded size, however long a run lasts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64


class History:
    """Rows of (time, values…), thinned evenly when the capacity is reached."""

    def __init__(self, value_count: int, capacity: int = 2000) -> None:
        self._rows = np.zeros((capacity, 1 + value_count))
        self._count = 0
        self._spacing = 0.0

    def __len__(self) -> int:
        return self._count

    def clear(self) -> None:
        """Drop all rows."""
        self._count, self._spacing = 0, 0.0

    def add(self, time: float, *values: float) -> bool:
        """Add a row, a number for each value, unless it follows the last one too closely."""
        if self._count:
            last = self._rows[self._count - 1, 0]
            if time <= last or time - last < self._spacing:
                return False
        if self._count == len(self._rows):
            half = self._rows[::2].copy()
            self._count = len(half)
            self._rows[: self._count] = half
            # Slightly less than the mean spacing: otherwise jitter would halve the rate again.
            self._spacing = 0.9 * (half[-1, 0] - half[0, 0]) / (self._count - 1)
        self._rows[self._count] = time, *values
        self._count += 1
        return True

    @property
    def columns(self) -> tuple[Float64[np.ndarray, "n"], ...]:
        """Times [s] and values, one array each."""
        return tuple(column.copy() for column in self._rows[: self._count].T)
