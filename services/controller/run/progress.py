"""How far the rope is from its goal, as seen, and whether it has settled there."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, chain_clearance, signed_distance

SETTLED_FOR = 300_000_000
"""[ns]"""
AT_REST = 0.01
"""Mean speed of the nodes below which the rope nearly rests, above what noise makes [m/s]."""
LOOK_AGAIN = 180_000_000
"""Between two looks at the clearance [ns]."""


PROGRESS = 0.03
"""Part of the error by which it must shrink to count as progress."""
STUCK_AFTER = 1_500_000_000
"""Without progress [ns]."""


class ProgressMonitor:
    """Measures of the run, from observations."""

    def __init__(self, tolerance: float, radius: float) -> None:
        """
        Args:
            tolerance: Mean node distance that counts as reached [m].
            radius: Of the rope [m].
        """
        self.tolerance, self.radius = tolerance, radius
        self.error = self.max_node_error = 0.0
        self.clearance = np.inf
        self.begin(0, 0)

    def begin(self, now: int, replan_count: int) -> None:
        """A run begins at `now` [ns]."""
        self.min_clearance = np.inf
        self.replans_before = replan_count
        self._recent: deque[tuple[int, float, Float64[np.ndarray, "n 3"]]] = deque()
        self._looked = 0
        self._best = (np.inf, now)

    def look(
        self,
        stamp: int,
        nodes: Float64[np.ndarray, "n 3"],
        goal: Float64[np.ndarray, "n 3"],
        obstacles: Sequence[Obstacle],
    ) -> None:
        """Takes in an observation of `stamp` [ns]."""
        distances = np.linalg.norm(nodes - goal, axis=1)
        self.error, self.max_node_error = float(np.mean(distances)), float(np.max(distances))
        self._recent.append((stamp, self.error, nodes))
        while stamp - self._recent[0][0] > SETTLED_FOR + 50_000_000:
            self._recent.popleft()
        if self.error < (1.0 - PROGRESS) * self._best[0]:
            self._best = self.error, stamp
        if stamp - self._looked >= LOOK_AGAIN:
            self._looked = stamp
            avoid = [o for o in obstacles if not o.support]
            self.clearance = self._exact_clearance(nodes, avoid)
            self.min_clearance = min(self.min_clearance, self.clearance)

    def _exact_clearance(
        self, nodes: Float64[np.ndarray, "n 3"], obstacles: Sequence[Obstacle]
    ) -> float:
        """Between the surfaces of the rope's segments and obstacles [m]."""
        rough = [float(np.min(signed_distance(nodes, o))) for o in obstacles]
        # A segment is nearer than its nodes by half an edge at most.
        reach = min(rough, default=0.0) + float(np.linalg.norm(nodes[1] - nodes[0]))
        candidates = [o for o, d in zip(obstacles, rough, strict=True) if d <= reach]
        return chain_clearance(nodes, self.radius, candidates)

    def settled(self, now: int) -> bool:
        """Within tolerance and nearly at rest for a while."""
        within = all(error <= self.tolerance for _, error, _ in self._recent)
        return within and self.resting(now)

    def resting(self, now: int) -> bool:
        """Nearly at rest for a while."""
        if len(self._recent) < 3 or now - self._recent[0][0] < SETTLED_FOR:
            return False
        third = max(1, len(self._recent) // 3)
        entries = list(self._recent)
        first = np.mean([n for _, _, n in entries[:third]], axis=0)
        last = np.mean([n for _, _, n in entries[-third:]], axis=0)
        elapsed = (entries[-1][0] - entries[0][0]) * 1e-9 * 2.0 / 3.0
        moved = float(np.mean(np.linalg.norm(last - first, axis=1)))
        return moved < AT_REST * max(elapsed, 1e-3)

    def stuck(self, now: int) -> bool:
        """Whether the error has not shrunk for a while."""
        return now - self._best[1] > STUCK_AFTER

    def clearance_of(
        self, shapes: Float64[np.ndarray, "t n 3"], obstacles: Sequence[Obstacle]
    ) -> float:
        """Least distance of nodes of several shapes from obstacles [m]."""
        nearest = [float(np.min(signed_distance(shapes, o))) for o in obstacles if len(shapes)]
        return min(nearest, default=np.inf) - self.radius
