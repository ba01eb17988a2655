"""Pairs of points and obstacles that are near each other: the active set of collision avoidance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry.obstacles import (
    Obstacle,
    bounding_box,
    out_of_reach,
    outward_normals,
    signed_distance,
)


@dataclass(frozen=True)
class NearPairs:
    """Pairs of a point and an obstacle whose distance is less than the reach of the point."""

    points: Int64[np.ndarray, "a"]
    """Indices of the points."""
    distances: Float64[np.ndarray, "a"]
    """Signed distances from the obstacles' surfaces, negative inside [m]."""
    normals: Float64[np.ndarray, "a 3"]
    """Unit normals that point away from the obstacles."""


NO_PAIRS = NearPairs(np.zeros(0, dtype=int), np.zeros(0), np.zeros((0, 3)))
"""No pair at all."""


def near_pairs(
    points: Float64[np.ndarray, "p 3"],
    obstacles: Sequence[Obstacle],
    reach: Float64[np.ndarray, "p"],
) -> NearPairs:
    """Return all pairs of a point and an obstacle closer than the reach of the point.

    Pairs are ordered by obstacle, then by point.

    Args:
        points: Points in the world frame [m].
        obstacles: Obstacles of the scene.
        reach: Distance below which a pair is returned, for each point [m].
    """
    indices, distances, outward = [], [], []
    if not len(points):
        return NO_PAIRS
    box, farthest = bounding_box(points), float(np.max(reach))
    for obstacle in obstacles:
        if out_of_reach(box, obstacle, farthest):
            continue
        distance = signed_distance(points, obstacle)
        (inside,) = np.nonzero(distance < reach)
        if len(inside):
            indices.append(inside)
            distances.append(distance[inside])
            outward.append(outward_normals(points[inside], obstacle))
    if not indices:
        return NO_PAIRS
    return NearPairs(np.concatenate(indices), np.concatenate(distances), np.concatenate(outward))
