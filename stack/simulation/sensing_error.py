"""Distance of the perceived rope from the true one, at equal arc length."""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Bool, Float64

from lariat.trajectory import SECOND
from stack.simulation.horizon_error import MIN_NODE_SPEED
from stack.simulation.true_rope import TrueRope

KEPT = SECOND
"""Time for which the true rope is kept, longer than an image is old when its nodes arrive [ns]."""


class SensingError:
    """Compares what is perceived with where the rope was at that time, while it moved.

    It is the noise that a prediction error is judged by.
    """

    def __init__(self) -> None:
        self._truth: deque[TrueRope] = deque()
        self._squares: list[float] = []

    @property
    def error(self) -> float | None:
        """Root mean square over seen nodes and images [m]; None when the rope never moved."""
        return float(np.sqrt(np.mean(self._squares))) if self._squares else None

    def take_rope(self, rope: TrueRope) -> None:
        """Remember the true rope."""
        self._truth.append(rope)
        while self._truth[0].stamp < rope.stamp - KEPT:
            self._truth.popleft()

    def take_seen(
        self, stamp: int, nodes: Float64[np.ndarray, "n 3"], observed: Bool[np.ndarray, "n"]
    ) -> None:
        """Compare perceived nodes with the true rope.

        Args:
            stamp: Time of the image [ns].
            nodes: Perceived nodes [m].
            observed: Nodes that were seen, not bridged.
        """
        pair = self._around(stamp)
        if pair is None or not np.any(observed):
            return
        old, new = pair
        moved = np.mean(np.linalg.norm(new.nodes - old.nodes, axis=1))
        speed = moved * SECOND / (new.stamp - old.stamp)
        if speed < MIN_NODE_SPEED:
            return
        true = _between(old, new, stamp).resampled(len(nodes))
        self._squares.append(float(np.mean(np.sum((nodes - true)[observed] ** 2, axis=1))))

    def _around(self, stamp: int) -> tuple[TrueRope, TrueRope] | None:
        """True ropes before and at or after a time; None if one of them is missing."""
        for k in range(len(self._truth) - 1, 0, -1):
            if self._truth[k - 1].stamp < stamp <= self._truth[k].stamp:
                return self._truth[k - 1], self._truth[k]
        return None


def _between(old: TrueRope, new: TrueRope, stamp: int) -> TrueRope:
    """Return the true rope at a time between two others, or at the later one."""
    if stamp == new.stamp:
        return new
    share = (stamp - old.stamp) / (new.stamp - old.stamp)
    return TrueRope(stamp, (1.0 - share) * old.nodes + share * new.nodes)
