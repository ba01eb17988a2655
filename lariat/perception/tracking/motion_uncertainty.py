"""Uncertainty of nodes along a rope whose grips move.

Nothing is measured along the rope: a node lies where the lengths of the edges between it and the
grips put it. A rope that is accelerated stretches, and its nodes shift along it; so they do where
the length of a stretch under another rope is uncertain.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose

SHIFT_TIME = 1e-3
"""Standard deviation of a node along the rope for each speed of the grips [s]; measured by
`lariat bench perception following`, seeds 100 to 102."""
HIDDEN_SHIFT = 0.01
"""Standard deviation of a node along the rope for each length of hidden rope [-]; measured by
`lariat bench perception following`, seeds 100 to 115."""
DECAY_TIME = 0.5
"""Time in which an earlier speed counts e times less, since the rope swings on [s]."""
HELD_COUNT = 2
"""Number of nodes at each end that the grip's pose fixes."""

Grips = tuple[Pose | None, Pose | None]


class MotionUncertainty:
    """Standard deviation that the motion of the grips adds."""

    def __init__(self) -> None:
        self._grips: Grips = (None, None)
        self._stamp = 0
        self._speed = 0.0

    def take(self, grips: Grips, count: int, stamp: int, hidden: float) -> Float64[np.ndarray, "n"]:
        """Return the standard deviation that is added at each node [m].

        Args:
            grips: Grips at the time of an image; None where they are unknown.
            count: Number of nodes n.
            stamp: Time of the exposure [ns].
            hidden: Length of rope that is not observed beside other ropes [m].
        """
        elapsed = (stamp - self._stamp) / 1e9
        if elapsed > 0.0:
            speeds = [
                float(np.linalg.norm(now.position - then.position)) / elapsed
                for now, then in zip(grips, self._grips, strict=True)
                if now is not None and then is not None
            ]
            self._speed = max([self._speed * math.exp(-elapsed / DECAY_TIME), *speeds])
        self._grips, self._stamp = grips, stamp
        sigma = np.full(count, math.hypot(SHIFT_TIME * self._speed, HIDDEN_SHIFT * hidden))
        sigma[:HELD_COUNT] = sigma[-HELD_COUNT:] = 0.0
        return sigma
