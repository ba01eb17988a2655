"""True rope at one time, as a score compares it with ropes of other node counts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines


class TrueRope:
    """Nodes of the true rope at one time."""

    def __init__(self, stamp: int, nodes: Float64[np.ndarray, "n 3"]) -> None:
        """Args: stamp: Time [ns]. nodes: Its nodes [m]."""
        self.stamp, self.nodes = stamp, nodes
        self._resampled: dict[int, Float64[np.ndarray, "m 3"]] = {}

    def resampled(self, count: int) -> Float64[np.ndarray, "m 3"]:
        """Return nodes at equal arc length [m], the same array again and again."""
        if count not in self._resampled:
            self._resampled[count] = polylines.resample_smooth(self.nodes, count)
        return self._resampled[count]
