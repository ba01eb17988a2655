"""The shortest way round obstacles between two points, as an upper bound.

A straight line when nothing is in the way; otherwise an elastic band, begun on four sides of what
blocks the line, that is pulled taut and pushed out of the obstacles in turn, from few points to
many. A band that stays outside is a way, so its length is never below the shortest one but for
`TOUCH`; when no band does, the answer is infinite.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle, segment_distance, signed_distance

LEVELS = (5, 9, 17, 33)
"""Points of a band, refined in turn."""
ROUNDS = 12
"""Of pulling and pushing at each level."""
LAYINGS = 4
"""Rounds of pushing out a band's fine points at the end."""
TOUCH = 1.5e-3
"""How deep a band may cut into an obstacle between its points [m]."""

Band = Float64[np.ndarray, "n 3"]


def taut_length(
    left: Float64[np.ndarray, "3"],
    right: Float64[np.ndarray, "3"],
    obstacles: Sequence[Obstacle],
) -> float:
    """Length of a short way from `left` to `right` outside all obstacles [m]."""
    straight = float(np.linalg.norm(right - left))
    ends = np.stack([left, right])
    # An end inside an obstacle is another rule's matter; round it there is no way.
    outside = [o for o in obstacles if np.min(signed_distance(ends, o)) > 0.0]
    if all(segment_distance(left[None], right[None], o)[0] >= 0.0 for o in outside):
        return straight
    return min(_length(left, right, outside, side) for side in _sides(right - left))


def _sides(axis: Float64[np.ndarray, "3"]) -> list[Float64[np.ndarray, "3"]]:
    """Four directions across an axis."""
    axis = axis / max(float(np.linalg.norm(axis)), 1e-12)
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    return [first, -first, second, -second]


def _length(
    left: Float64[np.ndarray, "3"],
    right: Float64[np.ndarray, "3"],
    obstacles: Sequence[Obstacle],
    side: Float64[np.ndarray, "3"],
) -> float:
    band = _bow(left, right, obstacles, side)
    for count in LEVELS:
        band = polylines.resampled(band, count)
        for _ in range(ROUNDS):
            band[1:-1] = 0.5 * (band[:-2] + band[2:])
            band[1:-1] = _pushed_out(band[1:-1], obstacles)
    # Between its points a band cuts edges; each round lays it closer over them.
    for _ in range(LAYINGS):
        band = _pushed_out(polylines.resampled(band, 8 * LEVELS[-1]), obstacles)
    between = (band[:-1] + band[1:]) / 2.0
    deepest = min(float(np.min(signed_distance(between, o))) for o in obstacles)
    return polylines.length(band) if deepest > -TOUCH else np.inf


def _bow(
    left: Float64[np.ndarray, "3"],
    right: Float64[np.ndarray, "3"],
    obstacles: Sequence[Obstacle],
    side: Float64[np.ndarray, "3"],
) -> Band:
    """A half wave wide enough to have nothing in its way, so that pulling keeps to its side."""
    t = np.linspace(0.0, 1.0, LEVELS[-1])[:, None]
    wave = np.sin(np.pi * t) * float(np.linalg.norm(right - left)) * side
    bows = [left + t * (right - left) + bulge * wave for bulge in (0.25, 0.5, 1.0, 2.0)]
    free = (b for b in bows if all(np.min(signed_distance(b, o)) > 0.0 for o in obstacles))
    return next(free, bows[-1])


def _pushed_out(points: Band, obstacles: Sequence[Obstacle]) -> Band:
    step = 1e-5
    for obstacle in obstacles:
        distance = signed_distance(points, obstacle)
        (inside,) = np.nonzero(distance < 0.0)
        if not len(inside):
            continue
        shifted = points[inside, None] + step * np.concatenate([np.eye(3), -np.eye(3)])
        d = signed_distance(shifted, obstacle)
        normals = d[:, :3] - d[:, 3:]
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        points = points.copy()
        points[inside] -= distance[inside, None] * normals
    return points
