"""Progress of a run: distance to the goal, clearance, and whether the rope has settled."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.obstacles import Obstacle, chain_clearance

SETTLING_TIME = 300_000_000
"""Duration for which the rope must rest within tolerance to have settled [ns]."""
MEMORY_MARGIN = 50_000_000
"""Duration beyond the settling time for which observations are kept [ns]."""
REST_SPEED = 0.01
"""Mean node speed below which the rope rests, above what noise makes [m/s]."""
CLEARANCE_PERIOD = 180_000_000
"""Minimum time between two computations of the clearance [ns]."""
PROGRESS_SHARE = 0.03
"""Decrease of the error that counts as progress, as a share of the error [-]."""
STUCK_TIME = 1_500_000_000
"""Time without progress, and since the end of its path, after which the rope is stuck [ns]."""


class ProgressMonitor:
    """Measures of a run, from observations of the rope."""

    def __init__(self, tolerance: float, radius: float, angle_tolerance: float = np.inf) -> None:
        """Create a monitor of no run.

        Args:
            tolerance: Mean node distance to the goal that counts as reached [m].
            radius: Radius of the rope [m].
            angle_tolerance: Angle of the ends from the goal that counts as reached [rad].
        """
        self.tolerance, self.radius = tolerance, radius
        self.angle_tolerance = angle_tolerance
        self.angle_error = 0.0
        """Angle of the rope's ends from a goal that they alone make up [rad]."""
        self.error = self.max_node_error = 0.0
        """Mean and maximum node distance to the goal [m]."""
        self.clearance = np.inf
        """Distance between the surfaces of rope and obstacles [m]."""
        self.begin(0, 0)

    def begin(self, now: int, replan_count: int) -> None:
        """Begin a run.

        Args:
            now: Present time [ns].
            replan_count: Number of paths requested before the run.
        """
        self.min_clearance = np.inf
        """Least clearance during the run [m]."""
        self._untaken_clearance = np.inf
        self.replans_before = replan_count
        self._recent: deque[tuple[int, float, Float64[np.ndarray, "n 3"]]] = deque()
        self._clearance_stamp = 0
        self._best = (np.inf, now)

    def observe(
        self,
        stamp: int,
        nodes: Float64[np.ndarray, "n 3"],
        goal: Float64[np.ndarray, "n 3"],
        obstacles: Sequence[Obstacle],
        counted: Bool[np.ndarray, "n"] | None = None,
        angle: float = 0.0,
    ) -> None:
        """Take in an observation.

        Args:
            stamp: Time of the observation [ns].
            nodes: Nodes of the rope [m].
            goal: Nodes of the goal [m].
            obstacles: Obstacles of the scene; supports do not count for the clearance.
            counted: Nodes whose distances from the goal count; by default all.
            angle: Angle of the rope's ends from the goal, where it counts [rad].
        """
        self.angle_error = angle
        distances = np.linalg.norm(nodes - goal, axis=1)
        if counted is not None:
            distances = distances[counted]
        self.error, self.max_node_error = float(np.mean(distances)), float(np.max(distances))
        self._recent.append((stamp, self.error, nodes))
        while stamp - self._recent[0][0] > SETTLING_TIME + MEMORY_MARGIN:
            self._recent.popleft()
        if self.error < (1.0 - PROGRESS_SHARE) * self._best[0]:
            self._best = self.error, stamp
        if stamp - self._clearance_stamp >= CLEARANCE_PERIOD:
            self._clearance_stamp = stamp
            avoided = [o for o in obstacles if not o.support]
            self.clearance = chain_clearance(nodes, self.radius, avoided)
            self.min_clearance = min(self.min_clearance, self.clearance)
            self._untaken_clearance = min(self._untaken_clearance, self.clearance)

    def take_clearance(self) -> float:
        """Return the least clearance since the last call [m], so that no minimum is lost."""
        least = min(self._untaken_clearance, self.clearance)
        self._untaken_clearance = np.inf
        return least

    def settled(self, now: int) -> bool:
        """Whether the rope has rested within tolerance of the goal for a while, at `now` [ns]."""
        within = all(error <= self.tolerance for _, error, _ in self._recent)
        within &= self.angle_error <= self.angle_tolerance
        return within and self.resting(now)

    def resting(self, now: int) -> bool:
        """Whether the rope has rested for a while, at `now` [ns]."""
        if len(self._recent) < 3 or now - self._recent[0][0] < SETTLING_TIME:
            return False
        third = max(1, len(self._recent) // 3)
        entries = list(self._recent)
        first = np.mean([n for _, _, n in entries[:third]], axis=0)
        last = np.mean([n for _, _, n in entries[-third:]], axis=0)
        elapsed = (entries[-1][0] - entries[0][0]) * 1e-9 * 2.0 / 3.0
        moved = float(np.mean(np.linalg.norm(last - first, axis=1)))
        return moved < REST_SPEED * max(elapsed, 1e-3)

    def stuck(self, now: int) -> bool:
        """Whether the error has not decreased for a while, at `now` [ns]."""
        return now - self._best[1] > STUCK_TIME
