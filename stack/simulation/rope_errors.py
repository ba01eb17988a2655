"""Errors of the controller's horizons and of the perceived rope, relative to the true rope."""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import polylines
from lariat.trajectory import SECOND
from shared.messages import Plan, chain

MIN_NODE_SPEED = 0.02
"""Mean speed of the true nodes below which an error does not count [m/s]."""
KEPT = SECOND
"""Time for which the true rope is kept, longer than an image is old when its nodes arrive [ns]."""


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


class _SquareMean:
    """Mean of squared node distances, of which those count that were measured in motion."""

    def __init__(self) -> None:
        self._squares: list[float] = []

    @property
    def error(self) -> float | None:
        """Root mean square over nodes and messages [m]; None when the rope never moved."""
        return float(np.sqrt(np.mean(self._squares))) if self._squares else None

    def _add(self, distances: Float64[np.ndarray, "n 3"]) -> None:
        self._squares.append(float(np.mean(np.sum(distances**2, axis=1))))


class HorizonError(_SquareMean):
    """Compares each horizon's end with where the rope then is.

    Unlike the error against what is seen, this one holds no noise of the seeing.
    """

    def __init__(self) -> None:
        super().__init__()
        self._ahead: deque[tuple[int, Float64[np.ndarray, "n 3"]]] = deque()
        self._before: TrueRope | None = None

    def take_plan(self, plan: Plan) -> None:
        """Remember the last chain of a horizon."""
        if not plan.nodes:
            return
        size = 3 * plan.node_count
        count = len(plan.nodes) // size
        self._ahead.append((plan.stamp + (count - 1) * plan.dt, chain(plan.nodes[-size:])))

    def take_rope(self, rope: TrueRope) -> None:
        """Compare what was foreseen for the time up to now with the true rope."""
        before, self._before = self._before, rope
        while self._ahead and self._ahead[0][0] <= rope.stamp:
            at, foreseen = self._ahead.popleft()
            if before is None or at <= before.stamp or not _moves(before, rope):
                continue
            there = _between(before, rope, at)
            same = len(there.nodes) == len(foreseen)
            self._add((there.nodes if same else there.resampled(len(foreseen))) - foreseen)


class SensingError(_SquareMean):
    """Compares what is perceived with where the rope was at that time, at equal arc length.

    It is the noise that a prediction error is judged by.
    """

    def __init__(self) -> None:
        super().__init__()
        self._truth: deque[TrueRope] = deque()

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
        if pair is not None and np.any(observed) and _moves(*pair):
            self._add((nodes - _between(*pair, stamp).resampled(len(nodes)))[observed])

    def _around(self, stamp: int) -> tuple[TrueRope, TrueRope] | None:
        """True ropes before and at or after a time; None if one of them is missing."""
        for k in range(len(self._truth) - 1, 0, -1):
            if self._truth[k - 1].stamp < stamp <= self._truth[k].stamp:
                return self._truth[k - 1], self._truth[k]
        return None


def _moves(old: TrueRope, new: TrueRope) -> bool:
    """Whether the rope moved fast enough between two times for an error to count."""
    moved = float(np.mean(np.linalg.norm(new.nodes - old.nodes, axis=1)))
    return moved * SECOND / (new.stamp - old.stamp) >= MIN_NODE_SPEED


def _between(old: TrueRope, new: TrueRope, stamp: int) -> TrueRope:
    """Return the true rope at a time between two others, or the later one."""
    if stamp == new.stamp:
        return new
    share = (stamp - old.stamp) / (new.stamp - old.stamp)
    return TrueRope(stamp, (1.0 - share) * old.nodes + share * new.nodes)
