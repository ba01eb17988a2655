"""Solids near some bodies, remembered while the bodies stay in the surroundings of where they were.

The neighbour list of molecular dynamics (Verlet, 1967): bodies move millimetres from one tick to
the next, so that most obstacles stay far for many ticks.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, Int64

from lariat.safety.constraints.obstacle_scene import ObstacleScene

SURROUNDINGS = 0.04
"""Distance by which the boxes of the bodies are widened when solids near them are listed [m]."""

Corners = Float64[np.ndarray, "k 3"]


class NearSolids:
    """List of the solids of a scene that may be near k spheres."""

    def __init__(self, surroundings: float = SURROUNDINGS) -> None:
        """Create an empty list.

        Args:
            surroundings: Distance by which the boxes of the bodies are widened [m]; 0 for bodies
                that are looked at once.
        """
        self._surroundings = surroundings
        self._scene: ObstacleScene | None = None
        self._low = self._high = np.zeros((0, 3))
        self.columns: Int64[np.ndarray, "n"] = np.zeros(0, dtype=int)
        """Indices of the listed solids."""
        self.far_slack = np.inf
        """Lower bound on the slack of the others [m]."""

    def update(
        self,
        scene: ObstacleScene,
        low: Corners,
        high: Corners,
        reach: Float64[np.ndarray, "k"],
        least_slack: float,
    ) -> None:
        """List the solids anew if the spheres have left their surroundings, or the scene is new.

        Args:
            scene: Scene of the solids.
            low: Lowest corner of the box around each sphere's path [m].
            high: Highest corner [m].
            reach: Distance from a sphere's centre at which its slack is zero [m].
            least_slack: Slack that all solids keep that are not listed [m].
        """
        if scene is self._scene and len(low) == len(self._low):
            inside = (low >= self._low) & (high <= self._high)
            if inside.all():
                return
        self._scene = scene
        self._low, self._high = low - self._surroundings, high + self._surroundings
        points = scene.centres
        outside = np.maximum(self._low[:, None] - points, points - self._high[:, None])
        gaps = np.linalg.norm(np.maximum(outside, 0.0), axis=-1) - reach[:, None]
        slacks = np.min(gaps, axis=0) - scene.radii
        near = slacks < least_slack
        self.columns = np.flatnonzero(near)
        self.far_slack = float(np.min(slacks, where=~near, initial=np.inf))
