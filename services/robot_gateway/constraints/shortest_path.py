"""Length of the shortest path round obstacles between two points, as an upper bound.

The path is straight where no obstacle is in the way. Otherwise it is found by elastic bands
(Quinlan and Khatib, 1993). Each begins on one of four sides of the obstacles, is contracted and
pushed out of the obstacles in turn, and is refined from few points to many. A band that stays
outside is a path, so its length is never below the shortest one except for `MAX_PENETRATION`. When
no band stays outside, the length is infinite.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle, segment_distance, signed_distance

POINT_COUNTS = (5, 9, 17, 33)
"""Numbers of points of a band, refined in turn."""
CONTRACTION_ROUNDS = 12
"""Rounds of contracting and pushing out for each number of points."""
FINAL_ROUNDS = 4
"""Rounds of pushing out the finely resampled band at the end."""
MAX_PENETRATION = 1.5e-3
"""Depth to which a band may cut into an obstacle between its points [m]."""
INITIAL_AMPLITUDES = (0.25, 0.5, 1.0, 2.0)
"""Amplitudes of the initial bands that are tried, relative to the straight distance [-]."""
NORMAL_STEP = 1e-5
"""Step of the central differences for an obstacle's normal [m]."""

Band = Float64[np.ndarray, "n 3"]


def shortest_path_length(
    left: Float64[np.ndarray, "3"],
    right: Float64[np.ndarray, "3"],
    obstacles: Sequence[Obstacle],
) -> float:
    """Return the length of a short path outside all obstacles; infinite where none is found [m].

    Args:
        left: First end [m].
        right: Second end [m].
        obstacles: Obstacles to go round; those that contain an end are ignored.
    """
    straight = float(np.linalg.norm(right - left))
    ends = np.stack([left, right])
    # An end inside an obstacle breaks another rule, and no path leads round that obstacle.
    outside = [o for o in obstacles if np.min(signed_distance(ends, o)) > 0.0]
    if all(segment_distance(left[None], right[None], o)[0] >= 0.0 for o in outside):
        return straight
    return min(_band_length(left, right, outside, side) for side in _sides(right - left))


def _sides(axis: Float64[np.ndarray, "3"]) -> list[Float64[np.ndarray, "3"]]:
    """Return four unit vectors across an axis."""
    axis = axis / max(float(np.linalg.norm(axis)), 1e-12)
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    return [first, -first, second, -second]


def _band_length(
    left: Float64[np.ndarray, "3"],
    right: Float64[np.ndarray, "3"],
    obstacles: Sequence[Obstacle],
    side: Float64[np.ndarray, "3"],
) -> float:
    """Return the length of a band that begins on one side; infinite if it ends up inside [m]."""
    band = _initial_band(left, right, obstacles, side)
    for count in POINT_COUNTS:
        band = polylines.resample(band, count)
        for _ in range(CONTRACTION_ROUNDS):
            band[1:-1] = 0.5 * (band[:-2] + band[2:])
            band[1:-1] = _pushed_out(band[1:-1], obstacles)
    # Between its points a band cuts edges; each round brings it closer to them.
    for _ in range(FINAL_ROUNDS):
        band = _pushed_out(polylines.resample(band, 8 * POINT_COUNTS[-1]), obstacles)
    between = (band[:-1] + band[1:]) / 2.0
    deepest = min(float(np.min(signed_distance(between, o))) for o in obstacles)
    return polylines.length(band) if deepest > -MAX_PENETRATION else np.inf


def _initial_band(
    left: Float64[np.ndarray, "3"],
    right: Float64[np.ndarray, "3"],
    obstacles: Sequence[Obstacle],
    side: Float64[np.ndarray, "3"],
) -> Band:
    """Return a half wave wide enough to be free, so that contracting keeps to its side."""
    t = np.linspace(0.0, 1.0, POINT_COUNTS[-1])[:, None]
    wave = np.sin(np.pi * t) * float(np.linalg.norm(right - left)) * side
    bands = [left + t * (right - left) + amplitude * wave for amplitude in INITIAL_AMPLITUDES]
    free = (b for b in bands if all(np.min(signed_distance(b, o)) > 0.0 for o in obstacles))
    return next(free, bands[-1])


def _pushed_out(points: Band, obstacles: Sequence[Obstacle]) -> Band:
    """Return the points, those inside an obstacle moved to its surface along its normal."""
    for obstacle in obstacles:
        distance = signed_distance(points, obstacle)
        (inside,) = np.nonzero(distance < 0.0)
        if not len(inside):
            continue
        shifted = points[inside, None] + NORMAL_STEP * np.concatenate([np.eye(3), -np.eye(3)])
        d = signed_distance(shifted, obstacle)
        normals = d[:, :3] - d[:, 3:]
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        points = points.copy()
        points[inside] -= distance[inside, None] * normals
    return points
