"""Points of the rope that come too near to an obstacle between two steps of a path.

Points move in straight lines from step to step. Instants are inserted where a body may lie between
two steps, so that a path that jumps over it costs as much as one that runs into it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry.obstacles import Obstacle, outward_normals, signed_distance
from lariat.geometry.swept_clearance import sweep_step

MAX_INSTANTS = 12
"""Largest number of instants that are inserted between two steps."""


@dataclass(frozen=True)
class SweptPairs:
    """Pairs of a point between two steps and an obstacle, nearer to each other than wanted."""

    steps: Int64[np.ndarray, "a"]
    """Indices of the steps at whose end the motion ends."""
    points: Int64[np.ndarray, "a"]
    """Indices of the points in a shape."""
    shares: Float64[np.ndarray, "a"]
    """Shares of the motion that are covered [-]."""
    lacks: Float64[np.ndarray, "a"]
    """Missing distance [m]."""
    normals: Float64[np.ndarray, "a 3"]
    """Unit normals that point away from the obstacles."""


def swept_pairs(
    points: Float64[np.ndarray, "h m 3"],
    distances: Float64[np.ndarray, "o h m"],
    obstacles: Sequence[Obstacle],
    radius: float,
    reach: Float64[np.ndarray, "s m"],
) -> SweptPairs:
    """Return the pairs that are nearer than the reach of their point, between the steps only.

    Args:
        points: Points at the start, and after each step [m].
        distances: Signed distances of the points from each obstacle [m].
        obstacles: Obstacles of the scene.
        radius: Radius of the rope [m].
        reach: Distance that each point keeps after each step, s = h - 1 [m].
    """
    longest = sweep_step(radius, obstacles)
    moves = np.linalg.norm(np.diff(points, axis=0), axis=2)
    columns: list[tuple[np.ndarray, ...]] = []
    for obstacle, distance in zip(obstacles, distances, strict=True):
        # A distance changes by at most the distance travelled: elsewhere no body lies in between.
        step, point = np.nonzero((distance[1:] + distance[:-1] < moves) & (moves > longest))
        if not len(step):
            continue
        counts = np.ceil(moves[step, point] / longest).astype(int) - 1
        counts = np.minimum(counts, MAX_INSTANTS)
        which = np.repeat(np.arange(len(step)), counts)
        order = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = (order + 1.0) / (counts[which] + 1.0)
        step, point = step[which], point[which]
        way = points[step + 1, point] - points[step, point]
        places = points[step, point] + share[:, None] * way
        lack = reach[step, point] - signed_distance(places, obstacle)
        near = lack > 0.0
        if near.any():
            normals = outward_normals(places[near], obstacle)
            columns.append((step[near], point[near], share[near], lack[near], normals))
    if not columns:
        none = np.zeros(0, dtype=int)
        return SweptPairs(none, none, np.zeros(0), np.zeros(0), np.zeros((0, 3)))
    steps, indices, shares, lacks, normals = (
        np.concatenate(column) for column in zip(*columns, strict=True)
    )
    return SweptPairs(steps, indices, shares, lacks, normals)
