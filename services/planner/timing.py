"""Puts a path of grips on a clock: from rest to rest, within the limits of the grippers.

The way-points are first passed at constant speed. Two running means over time then round what
happens at the corners: after the first one the acceleration is bounded by the change of velocity
over its width, after the second one the jerk by the change of acceleration over its own. The first
and the last point stay where they are because the path waits there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from shared.geometry import poses
from shared.scenario.sections import Limits

SHARE = 0.7
"""Of each limit that a path uses; the rest is left to the control of the rope."""


@dataclass(frozen=True)
class Pace:
    """How hurried a path is."""

    slowdown: float = 1.0
    """How much slower than the limits allow; at least 1."""
    means: tuple[float, float] = (0.24, 0.10)
    """Widths of the two running means before slowing down [s]. A mean as wide as the period in
    which the rope swings leaves it still."""


def timed(
    positions: Float64[np.ndarray, "w 2 3"],
    orientations: Float64[np.ndarray, "w 2 4"],
    limits: Limits,
    dt: float,
    pace: Pace,
) -> tuple[Float64[np.ndarray, "t 2 3"], Float64[np.ndarray, "t 2 4"]]:
    """Positions [m] and orientations of both grips every `dt` [s], no faster than `pace`."""
    vectors = _rotation_vectors(orientations)
    ways = np.concatenate([positions, vectors], axis=2)
    stretch = pace.slowdown
    points = _passed(ways, limits, dt, stretch, pace.means)
    for _ in range(3):
        excess = _excess(points, limits, dt)
        if excess <= 1.0:
            break
        stretch *= 1.02 * excess
        points = _passed(ways, limits, dt, stretch, pace.means)
    turned = poses.multiply(poses.exponential(points[..., 3:]), orientations[:1])
    return points[..., :3], poses.normalized(turned)


def _passed(
    ways: Float64[np.ndarray, "w 2 6"],
    limits: Limits,
    dt: float,
    stretch: float,
    means: tuple[float, float],
) -> Float64[np.ndarray, "t 2 6"]:
    steps = np.diff(ways, axis=0)
    least = np.maximum(
        np.linalg.norm(steps[..., :3], axis=2).max(axis=1) / limits.speed,
        np.linalg.norm(steps[..., 3:], axis=2).max(axis=1) / limits.angular_speed,
    )
    times = np.concatenate([[0.0], np.cumsum(least * stretch / SHARE)])
    widths = [max(1, round(mean * stretch / dt)) for mean in means]
    wait = sum(widths)
    count = int(np.ceil(times[-1] / dt)) + 1
    at = dt * np.arange(-wait, count + wait)
    flat = ways.reshape(len(ways), 12)
    points = np.stack([np.interp(at, times, column) for column in flat.T], axis=1)
    for width in widths:
        sums = np.cumsum(np.concatenate([np.zeros((1, 12)), points]), axis=0)
        points = (sums[width:] - sums[:-width]) / width
    moving = np.flatnonzero(np.any(np.abs(np.diff(points, axis=0)) > 1e-12, axis=1))
    if len(moving) == 0:
        return ways[-1:].repeat(2, axis=0)
    first, last = moving[0], moving[-1] + 1
    # A still point on both sides: the path begins and ends at rest.
    points = points[max(first - 1, 0) : last + 3].reshape(-1, 2, 6)
    points[0], points[-1] = ways[0], ways[-1]
    return points


def _excess(points: Float64[np.ndarray, "t 2 6"], limits: Limits, dt: float) -> float:
    """By what factor time must be stretched for the shares of all limits to hold."""
    padded = np.concatenate([points[:1]] * 3 + [points] + [points[-1:]] * 3)
    bounds = (
        (limits.speed, limits.angular_speed),
        (limits.acceleration, limits.angular_acceleration),
        (limits.jerk, limits.angular_jerk),
    )
    worst = 0.0
    for order, pair in enumerate(bounds, start=1):
        change = np.diff(padded, n=order, axis=0) / dt**order
        for part, bound in zip((change[..., :3], change[..., 3:]), pair, strict=True):
            most = float(np.linalg.norm(part, axis=2).max(initial=0.0))
            worst = max(worst, (most / (1.001 * SHARE * bound)) ** (1.0 / order))
    return worst


def _rotation_vectors(orientations: Float64[np.ndarray, "w 2 4"]) -> Float64[np.ndarray, "w 2 3"]:
    """Rotations from the first orientation, world frame, summed up so that turns are kept [rad]."""
    back = poses.conjugate(orientations[:-1])
    steps = poses.logarithm(poses.multiply(orientations[1:], back))
    vectors = np.zeros((len(orientations), 2, 3))
    total = orientations[0]
    for k, step in enumerate(steps, start=1):
        total = poses.multiply(poses.exponential(step), total)
        direct = poses.logarithm(poses.multiply(total, poses.conjugate(orientations[0])))
        angle = np.linalg.norm(direct, axis=1, keepdims=True)
        axis = direct / np.maximum(angle, 1e-12)
        along = np.sum((vectors[k - 1] + step - direct) * axis, axis=1, keepdims=True)
        vectors[k] = direct + 2.0 * np.pi * np.round(along / (2.0 * np.pi)) * axis
    return vectors
