"""Guard of the clearance: stops the arms before the rope touches an obstacle.

The horizon keeps the rope clear by a penalty and as far as its model is right. The guard asks of
every horizon whether the rope, predicted with its measured error, and the rope that is observed
stay clear. It reports an approach only: a rope that leaves an obstacle is let go.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import (
    Obstacle,
    bounding_box,
    out_of_reach,
    segment_distance,
    signed_distance,
)

COARSE_STRIDE = 4
"""Nodes per node whose distance from every obstacle is computed."""
MIN_CLEARANCE = 0.003
"""Clearance that the rope keeps, uncertainty deducted [m]."""
WANTED_SHARE = 0.5
"""Share of the wanted clearance that is enough, where that is less [-]."""
DEVIATIONS = 2.0
"""Measured deviations of the prediction that are deducted at the end of the horizon [-]."""
MAX_UNCERTAINTY = 0.02
"""Largest uncertainty that is deducted [m]: the rope has to move to be observed."""
MIN_APPROACH = 0.002
"""Decrease of the clearance within a horizon that counts as an approach [m]."""


@dataclass(frozen=True)
class Threat:
    """Contact that is to be expected."""

    obstacle: str
    """Name of the obstacle."""
    clearance: float
    """Present clearance from it [m]."""
    predicted: float
    """Least predicted clearance from it [m]."""
    uncertainty: float
    """Uncertainty of the prediction [m]."""
    limit: float
    """Clearance that is wanted at the end of the horizon [m]."""
    lack: float
    """Largest clearance that is missing [m]."""


class ClearanceGuard:
    """Checks every horizon, and every observation, for contact."""

    def __init__(self, radius: float, clearance: float = np.inf) -> None:
        """Create a guard.

        Args:
            radius: Radius of the rope [m].
            clearance: Clearance that paths are asked to keep [m].
        """
        self._radius = radius
        self.want(clearance)

    def want(self, clearance: float) -> None:
        """Take the clearance that paths are asked to keep [m]."""
        self._least = min(MIN_CLEARANCE, WANTED_SHARE * clearance)

    def check(
        self,
        observed: Float64[np.ndarray, "n 3"],
        estimate: Float64[np.ndarray, "n 3"],
        predicted: Float64[np.ndarray, "h n 3"],
        deviation: float,
        obstacles: Sequence[Obstacle],
        accepted: float = np.inf,
    ) -> Threat | None:
        """Return the worst contact to be expected; None when the rope stays clear.

        Args:
            observed: Nodes of the rope as observed last [m].
            estimate: Nodes of the rope as estimated now [m].
            predicted: Nodes of the rope after each step of the horizon [m].
            deviation: Root mean square node error at the end of a horizon [m].
            accepted: Clearance that start or goal have themselves [m].
        """
        uncertainty = min(DEVIATIONS * deviation, MAX_UNCERTAINTY)
        chains = np.concatenate([observed[None], estimate[None], predicted])
        shares = np.concatenate([[0.0, 0.0], np.arange(1, len(predicted) + 1) / len(predicted)])
        limits = min(self._least, accepted) + uncertainty * shares
        limits[0] = min(self._least, accepted - MIN_APPROACH)
        box, reach = bounding_box(chains), self._radius + float(np.max(limits))
        worst: Threat | None = None
        for obstacle in obstacles:
            # Most obstacles are ruled out by the box around all chains, most others by a few nodes.
            if out_of_reach(box, obstacle, reach) or self._far(chains, estimate, reach, obstacle):
                continue
            rough = signed_distance(chains, obstacle) - self._radius
            bounds = _segment_bounds(chains, rough)
            if np.all(np.min(bounds, axis=1) >= limits):
                continue
            clearances = self._clearances(chains, rough, bounds, obstacle)
            now, ahead = clearances[1], clearances[2:]
            approaches = np.any((ahead < limits[2:]) & (ahead < now - MIN_APPROACH))
            touches = clearances[0] < limits[0] and ahead[-1] <= now
            if not approaches and not touches:
                continue
            threat = Threat(
                obstacle.name,
                float(min(clearances[0], now)),
                float(np.min(ahead)),
                uncertainty,
                float(limits[-1]),
                float(np.max(limits - clearances)),
            )
            if worst is None or threat.predicted < worst.predicted:
                worst = threat
        return worst

    @staticmethod
    def _far(
        chains: Float64[np.ndarray, "k n 3"],
        estimate: Float64[np.ndarray, "n 3"],
        reach: float,
        obstacle: Obstacle,
    ) -> bool:
        """Whether a few nodes show that no chain comes as near to an obstacle as `reach` [m]."""
        # A distance changes by at most the distance travelled.
        moved = float(np.max(np.linalg.norm(chains - estimate, axis=2)))
        edge = float(np.max(np.linalg.norm(np.diff(estimate, axis=0), axis=1)))
        coarse = estimate[::COARSE_STRIDE]
        nearest = float(np.min(signed_distance(coarse, obstacle)))
        return nearest > reach + moved + COARSE_STRIDE * edge

    def _clearances(
        self,
        chains: Float64[np.ndarray, "k n 3"],
        rough: Float64[np.ndarray, "k n"],
        bounds: Float64[np.ndarray, "k n-1"],
        obstacle: Obstacle,
    ) -> Float64[np.ndarray, "k"]:
        """Clearance between the segments of each chain and an obstacle [m]."""
        least = np.min(rough, axis=1)
        at, index = np.nonzero(bounds < least[:, None])
        if len(at):
            exact = segment_distance(chains[at, index], chains[at, index + 1], obstacle)
            np.minimum.at(least, at, exact - self._radius)
        return least


def _segment_bounds(
    chains: Float64[np.ndarray, "k n 3"], rough: Float64[np.ndarray, "k n"]
) -> Float64[np.ndarray, "k n-1"]:
    """Return lower bounds on the clearance of each segment from those of its nodes [m]."""
    lengths = np.linalg.norm(chains[:, 1:] - chains[:, :-1], axis=2)
    return 0.5 * (rough[:, :-1] + rough[:, 1:] - lengths)
