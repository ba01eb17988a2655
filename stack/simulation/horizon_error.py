"""Prediction error at the end of the controller's horizons, relative to the true rope."""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.trajectory import SECOND
from shared.messages import Plan, chain

MIN_NODE_SPEED = 0.02
"""Mean speed of the true nodes below which a prediction does not count [m/s]."""


class HorizonError:
    """Compares each horizon's end with where the rope then is.

    Unlike the error against what is seen, this one holds no noise of the seeing.
    """

    def __init__(self) -> None:
        self._ahead: deque[tuple[int, Float64[np.ndarray, "n 3"]]] = deque()
        self._before: tuple[int, Float64[np.ndarray, "n 3"]] | None = None
        self._squares: list[float] = []

    @property
    def error(self) -> float | None:
        """Root mean square over nodes and horizons [m]; None when the rope never moved."""
        return float(np.sqrt(np.mean(self._squares))) if self._squares else None

    def take_plan(self, plan: Plan) -> None:
        """Remembers the last chain of a horizon."""
        if not plan.nodes:
            return
        size = 3 * plan.node_count
        count = len(plan.nodes) // size
        self._ahead.append((plan.stamp + (count - 1) * plan.dt, chain(plan.nodes[-size:])))

    def take_rope(self, stamp: int, nodes: Float64[np.ndarray, "n 3"]) -> None:
        """Weighs what was foreseen for the time up to `stamp` [ns] by the true rope."""
        before, self._before = self._before, (stamp, nodes)
        while self._ahead and self._ahead[0][0] <= stamp:
            at, foreseen = self._ahead.popleft()
            if before is None or at <= before[0]:
                continue
            elapsed = (stamp - before[0]) / SECOND
            speed = float(np.mean(np.linalg.norm(nodes - before[1], axis=1))) / elapsed
            if speed < MIN_NODE_SPEED:
                continue
            share = (at - before[0]) / (stamp - before[0])
            there = (1.0 - share) * before[1] + share * nodes
            if len(there) != len(foreseen):
                there = polylines.resample_smooth(there, len(foreseen))
            self._squares.append(float(np.mean(np.sum((there - foreseen) ** 2, axis=1))))
