"""Rope length constraint: the rope reaches round all obstacles (rule `overstretch`)."""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Float64

from services.robot_gateway.constraints.obstacle_scene import ObstacleScene
from services.robot_gateway.constraints.shortest_path import shortest_path_length

CACHED_PATHS = 32
"""Number of shortest paths that are remembered."""


class RopeLengthConstraint:
    """Length of the shortest path round the obstacles between the grips.

    Shortest paths are expensive, so a few are remembered: a path grows by no more than its ends
    move, so that each known one bounds the length for all poses nearby.
    """

    def __init__(self, max_length: float) -> None:
        """Create the constraint without obstacles.

        Args:
            max_length: Longest permitted path between the grips [m].
        """
        self.max_length = max_length
        self.replace_scene(ObstacleScene())

    def replace_scene(self, scene: ObstacleScene) -> None:
        """Take another scene and discard the remembered paths."""
        self._scene = scene
        self._cache: deque[tuple[np.ndarray, float]] = deque(maxlen=CACHED_PATHS)

    def slack(
        self, positions: Float64[np.ndarray, "m 2 3"], distances: Float64[np.ndarray, "m"]
    ) -> Float64[np.ndarray, "m"]:
        """Return by how much the path between the grips is shorter than permitted, at m poses [m].

        Args:
            positions: Positions of both grips [m].
            distances: Straight distances between them [m].
        """
        return self.max_length - self._lengths(positions, distances)

    def _lengths(
        self, positions: Float64[np.ndarray, "m 2 3"], distances: Float64[np.ndarray, "m"]
    ) -> Float64[np.ndarray, "m"]:
        """Return upper bounds on the shortest paths, tight where they exceed the limit [m]."""
        if not self._may_block(positions):
            return distances
        lengths = self._upper_bounds(positions)
        for _ in range(len(positions)):
            worst = int(np.argmax(lengths))
            if lengths[worst] <= self.max_length:
                break
            ends = positions[worst]
            found = shortest_path_length(ends[0], ends[1], self._scene.obstacles)
            self._cache.append((ends, found))
            if found > self.max_length and worst > 0:
                lengths[worst] = found
                break
            lengths = self._upper_bounds(positions)
        return np.maximum(lengths, distances)

    def _upper_bounds(self, positions: Float64[np.ndarray, "m 2 3"]) -> Float64[np.ndarray, "m"]:
        """Return upper bounds from the remembered paths and the motion of the ends [m]."""
        if not self._cache:
            return np.full(len(positions), np.inf)
        ends = np.array([ends for ends, _ in self._cache])
        lengths = np.array([length for _, length in self._cache])
        moved = np.linalg.norm(positions[:, None] - ends, axis=-1).sum(axis=-1)
        return np.min(lengths + moved, axis=1)

    def _may_block(self, positions: Float64[np.ndarray, "m 2 3"]) -> bool:
        """Return whether any bounding sphere touches a straight line between the grips.

        A half space is convex and both grips are outside, so it blocks no straight line.
        """
        scene = self._scene
        if not len(scene.radii):
            return False
        start = positions[:, 0, None]
        line = positions[:, 1, None] - start
        offset = scene.centres - start
        along = np.sum(offset * line, axis=-1) / np.maximum(np.sum(line * line, axis=-1), 1e-12)
        nearest = offset - np.clip(along, 0.0, 1.0)[..., None] * line
        return bool(np.any(np.sum(nearest * nearest, axis=-1) < scene.radii**2))
