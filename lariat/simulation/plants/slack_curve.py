"""Slack curve between two grips, from which a rope is let down to its rest shape."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose

TANGENT_WEIGHT = 0.5
"""Length of the spline's end tangents, relative to the length of the rope [-]."""
BISECTION_COUNT = 30
"""Number of bisection steps on the depth of the sag."""


def slack_curve(
    left: Pose, right: Pose, length: float, count: int
) -> Float64[np.ndarray, "count 3"]:
    """Return a curve of about a given length that leaves both grips along their directions [m].

    The curve is a cubic Hermite spline plus a sag under gravity that grows until the curve is long
    enough.

    Args:
        left: Pose of the left grip.
        right: Pose of the right grip.
        length: Length of the curve [m].
        count: Number of points.
    """
    a, b = left.position, right.position
    z = np.array([0.0, 0.0, 1.0])
    first, last = poses.rotate(left.orientation, z), poses.rotate(right.orientation, z)
    chord = float(np.linalg.norm(b - a))
    sag = np.array([0.0, 0.0, -1.0]) * 0.6 * np.sqrt(max(length**2 - chord**2, 0.0))
    t = np.linspace(0.0, 1.0, 20 * count)[:, None]
    value, rise, fall = t * t * (3.0 - 2.0 * t), t * (t - 1.0) ** 2, t * t * (t - 1.0)

    def curve(depth: float) -> Float64[np.ndarray, "m 3"]:
        slopes = TANGENT_WEIGHT * length * (rise * first + fall * last)
        return a + value * (b - a) + slopes + 4.0 * t * (1.0 - t) * depth * sag

    def curve_length(nodes: Float64[np.ndarray, "m 3"]) -> float:
        return float(np.sum(np.linalg.norm(np.diff(nodes, axis=0), axis=1)))

    low, high = 0.0, 3.0
    for _ in range(BISECTION_COUNT):
        middle = (low + high) / 2.0
        low, high = (middle, high) if curve_length(curve(middle)) < length else (low, middle)
    path = curve(low)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, s[-1], count)
    return np.stack([np.interp(at, s, path[:, k]) for k in range(3)], axis=1)
