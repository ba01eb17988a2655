"""Least clearance of a rope over a run, and its time in contact.

Ropes are gathered and measured together: most of their edges are ruled out by the nearest node of
all of them, and the others share the calls.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import (
    Obstacle,
    bounding_box,
    out_of_reach,
    segment_distance,
    signed_distance,
)
from lariat.trajectory import SECOND

CONTACT_DISTANCE = 0.0
"""Distance of the surfaces of rope and obstacle at and below which they touch [m]."""
GATHERED = 32
"""Number of ropes that are measured together."""

Ropes = Float64[np.ndarray, "b n 3"]


class LeastClearance:
    """Least distance between the surfaces of rope and obstacles, and time in contact."""

    def __init__(self, radius: float) -> None:
        """Begin without a rope. Args: radius: Radius of the rope [m]."""
        self._radius = radius
        self._least = np.inf
        self._contact_time = 0.0
        self._gathered: list[tuple[float, Float64[np.ndarray, "n 3"], tuple[Obstacle, ...]]] = []

    @property
    def least(self) -> float:
        """Least distance between the surfaces so far, infinite without obstacles [m]."""
        self._measure()
        return self._least

    @property
    def contact_time(self) -> float:
        """Time in contact so far [s]."""
        self._measure()
        return self._contact_time

    def take(
        self, elapsed: int, nodes: Float64[np.ndarray, "n 3"], obstacles: tuple[Obstacle, ...]
    ) -> None:
        """Take a rope and the obstacles around it.

        Args:
            elapsed: Time since the rope before [ns].
            nodes: Nodes of the rope [m].
            obstacles: Obstacles at the same time.
        """
        full = len(self._gathered) == GATHERED
        if full or (self._gathered and len(self._gathered[-1][1]) != len(nodes)):
            self._measure()
        self._gathered.append((elapsed / SECOND, nodes, obstacles))

    def _measure(self) -> None:
        """Measure the ropes that have been gathered."""
        if not self._gathered:
            return
        times, rows, scenes = zip(*self._gathered, strict=True)
        self._gathered = []
        ropes = np.array(rows)
        rows_of: dict[Obstacle, list[int]] = defaultdict(list)
        for row, scene in enumerate(scenes):
            for obstacle in scene:
                rows_of[obstacle].append(row)
        nearest = np.full(len(ropes), np.inf)
        checked = []
        for obstacle, among in rows_of.items():
            some = ropes if len(among) == len(ropes) else ropes[among]
            reach = self._radius + max(min(self._least, float(nearest.min())), CONTACT_DISTANCE)
            if out_of_reach(bounding_box(some), obstacle, reach):
                continue
            distances = signed_distance(some, obstacle) - self._radius
            nearest[among] = np.minimum(nearest[among], distances.min(axis=1))
            checked.append((obstacle, among, some, distances))
        for each in checked:
            self._measure_edges(nearest, *each)
        self._least = min(self._least, float(nearest.min()))
        self._contact_time += sum(
            time
            for time, clearance in zip(times, nearest.tolist(), strict=True)
            if clearance <= CONTACT_DISTANCE
        )

    def _measure_edges(
        self,
        nearest: Float64[np.ndarray, "m"],
        obstacle: Obstacle,
        among: Sequence[int],
        ropes: Ropes,
        distances: Float64[np.ndarray, "b n"],
    ) -> None:
        """Lower the clearances of ropes by those of edges that may be least, or in contact.

        Args:
            nearest: Clearances of all ropes that are measured [m].
            obstacle: One obstacle.
            among: Indices of the ropes beside it.
            ropes: Nodes of these [m].
            distances: Clearances of the nodes [m].
        """
        lengths = np.linalg.norm(np.diff(ropes, axis=1), axis=2)
        # A distance function has slope 1: this is a lower bound for all points of an edge.
        bounds = (distances[:, :-1] + distances[:, 1:] - lengths) / 2.0
        least = min(self._least, float(nearest.min()))
        rope, edge = np.nonzero(bounds < max(least, CONTACT_DISTANCE))
        if len(rope):
            between = segment_distance(ropes[rope, edge], ropes[rope, edge + 1], obstacle)
            np.minimum.at(nearest, np.array(among)[rope], between - self._radius)
