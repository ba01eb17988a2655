"""Points of a moving body that come too near to an obstacle, after a step of a path or between two.

Points move in straight lines from step to step. Instants are inserted where a body may lie between
two steps, so that a path that jumps over it costs as much as one that runs into it.
"""

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
from lariat.geometry.swept_clearance import sweep_step

MAX_INSTANTS = 12
"""Usual largest number of instants that are inserted between two steps."""


@dataclass(frozen=True)
class SweptPairs:
    """Pairs of a point and an obstacle, nearer to each other than wanted."""

    steps: Int64[np.ndarray, "a"]
    """Indices of the steps with whose end the motion ends."""
    points: Int64[np.ndarray, "a"]
    """Indices of the points in a shape."""
    shares: Float64[np.ndarray, "a"]
    """Shares of the motion that are covered; 1 after the step [-]."""
    lacks: Float64[np.ndarray, "a"]
    """Missing distance [m]."""
    normals: Float64[np.ndarray, "a 3"]
    """Unit normals that point away from the obstacles."""


def swept_pairs(
    points: Float64[np.ndarray, "h m 3"],
    obstacles: Sequence[Obstacle],
    radius: float,
    margins: Float64[np.ndarray, "s m"],
    instants: int = MAX_INSTANTS,
) -> SweptPairs:
    """Return the pairs whose surfaces are nearer than the margin of their point.

    Args:
        points: Points at the start, and after each step [m].
        radius: Radius of the body around the points [m].
        margins: Clearance that each point keeps after each step, s = h - 1 [m].
        instants: Largest number of instants that are inserted between two steps.
    """
    longest, reach = sweep_step(radius, obstacles), margins + radius
    moves = np.linalg.norm(np.diff(points, axis=0), axis=2)
    none = np.zeros(0, dtype=int)
    columns = [(none, none, np.zeros(0), np.zeros(0), np.zeros((0, 3)))]
    box, farthest = bounding_box(points), float(np.max(reach))
    for obstacle in obstacles:
        if out_of_reach(box, obstacle, farthest):
            continue
        distance = signed_distance(points, obstacle)
        step, point = np.nonzero(distance[1:] < reach)
        share = np.ones(len(step))
        # A distance changes by at most the distance travelled: elsewhere no body lies in between.
        jump, jumping = np.nonzero((distance[1:] + distance[:-1] < moves) & (moves > longest))
        counts = np.ceil(moves[jump, jumping] / longest).astype(int) - 1
        counts = np.minimum(counts, instants)
        which = np.repeat(np.arange(len(jump)), counts)
        order = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = np.concatenate([share, (order + 1.0) / (counts[which] + 1.0)])
        step = np.concatenate([step, jump[which]])
        point = np.concatenate([point, jumping[which]])
        way = points[step + 1, point] - points[step, point]
        places = points[step, point] + share[:, None] * way
        lack = reach[step, point] - signed_distance(places, obstacle)
        near = lack > 0.0
        if near.any():
            normals = outward_normals(places[near], obstacle)
            columns.append((step[near], point[near], share[near], lack[near], normals))
    steps, indices, shares, lacks, normals = (
        np.concatenate(column) for column in zip(*columns, strict=True)
    )
    return SweptPairs(steps, indices, shares, lacks, normals)
