"""Detection of a rope that has slipped out of a grip.

The model holds the rope in both grips. An end of the rope that is seen elsewhere, and stays there,
has left its grip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.scenario import SIDES, Side

MAX_DISTANCE = 0.03
"""Distance of an end of the rope from its grip above which the grip does not hold it [m]; errors of
grips and camera are smaller."""
OBSERVATIONS = 4
"""Successive observations of such an end."""


@dataclass(frozen=True)
class Slip:
    """Grip that does not hold the rope."""

    side: Side
    """The grip."""
    distance: float
    """Distance of the rope's end from it [m]."""


class SlipDetector:
    """Detector that compares the ends of the observed rope with the grips."""

    def __init__(self) -> None:
        """Create a detector without observations."""
        self.reset()

    def reset(self) -> None:
        """Drop all observations."""
        self._signs = [0, 0]

    @property
    def suspects(self) -> bool:
        """Whether an end was away from its grip in the last observation."""
        return any(self._signs)

    def observe(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
        grips: Float64[np.ndarray, "2 3"],
    ) -> Slip | None:
        """Take in an observation; return a slip once its sign has lasted.

        Args:
            nodes: Observed nodes [m].
            observed: Nodes that were seen, not bridged.
            grips: Positions of both grips at the same time [m].
        """
        slip = None
        distances = np.linalg.norm(nodes[[0, -1]] - grips, axis=1)
        for k, node in enumerate((0, -1)):
            away = bool(observed[node]) and distances[k] > MAX_DISTANCE
            self._signs[k] = self._signs[k] + 1 if away else 0
            if self._signs[k] >= OBSERVATIONS:
                slip = Slip(SIDES[k], float(distances[k]))
        return slip
