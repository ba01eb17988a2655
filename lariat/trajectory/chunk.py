"""Setpoint chunk: poses of grippers on a uniform time grid.

Times are integer nanoseconds, so that grids of different chunks coincide exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

SECOND = 1_000_000_000
"""Duration of a second [ns]."""
NANOSECONDS = 1e-9
"""Seconds per nanosecond [s]."""


@dataclass(frozen=True)
class SetpointChunk:
    """k poses of n grippers, a constant time apart, the oldest first."""

    start: int
    """Time of the first pose on the clock of the writer [ns]."""
    dt: float
    """Time between two poses [s]."""
    positions: Float64[np.ndarray, "k n 3"]
    """Positions in the world frame [m]."""
    orientations: Float64[np.ndarray, "k n 4"]
    """Unit quaternions in the world frame, wxyz."""

    @property
    def span(self) -> float:
        """Time from the first pose to the last [s]."""
        return (len(self.positions) - 1) * self.dt
