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

from lariat.geometry import poses
from lariat.trajectory import MotionLimits
from shared.motion_contract import PATH_LIMIT_SHARE

AXIS = np.array([0.0, 0.0, 1.0])
"""Of the rope in a grip."""


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
    limits: MotionLimits,
    dt: float,
    pace: Pace,
) -> tuple[Float64[np.ndarray, "t 2 3"], Float64[np.ndarray, "t 2 4"]]:
    """Positions [m] and orientations of both grips every `dt` [s], no faster than `pace`."""
    middle, angles = _unrolled(orientations)
    ways = np.concatenate([positions, angles], axis=2)
    least = _durations(positions, orientations, limits)
    stretch = pace.slowdown
    for _ in range(3):
        points, turned = _at_pace(ways, middle, least, stretch, dt, pace)
        excess = _excess(points, turned, limits, dt)
        if excess <= 1.0:
            return points, turned
        stretch *= 1.02 * excess
    return _at_pace(ways, middle, least, stretch, dt, pace)


def _at_pace(
    ways: Float64[np.ndarray, "w 2 7"],
    middle: Float64[np.ndarray, "2 4"],
    least: Float64[np.ndarray, "w-1"],
    stretch: float,
    dt: float,
    pace: Pace,
) -> tuple[Float64[np.ndarray, "t 2 3"], Float64[np.ndarray, "t 2 4"]]:
    points = _passed(ways, least * stretch, dt, [m * stretch for m in pace.means])
    return points[..., :3], _rolled_up(middle, points[..., 3:])


def _durations(
    positions: Float64[np.ndarray, "w 2 3"],
    orientations: Float64[np.ndarray, "w 2 4"],
    limits: MotionLimits,
) -> Float64[np.ndarray, "w-1"]:
    """Least time between way-points [s]."""
    turned = poses.multiply(orientations[1:], poses.conjugate(orientations[:-1]))
    return np.maximum(
        np.linalg.norm(np.diff(positions, axis=0), axis=2).max(axis=1) / limits.speed,
        np.linalg.norm(poses.logarithm(turned), axis=2).max(axis=1) / limits.angular_speed,
    )


def _passed(
    ways: Float64[np.ndarray, "w 2 7"],
    durations: Float64[np.ndarray, "w-1"],
    dt: float,
    means: list[float],
) -> Float64[np.ndarray, "t 2 7"]:
    times = np.concatenate([[0.0], np.cumsum(durations / PATH_LIMIT_SHARE)])
    widths = [max(1, round(mean / dt)) for mean in means]
    wait = sum(widths)
    count = int(np.ceil(times[-1] / dt)) + 1
    at = dt * np.arange(-wait, count + wait)
    flat = ways.reshape(len(ways), 14)
    points = np.stack([np.interp(at, times, column) for column in flat.T], axis=1)
    for width in widths:
        sums = np.cumsum(np.concatenate([np.zeros((1, 14)), points]), axis=0)
        points = (sums[width:] - sums[:-width]) / width
    moving = np.flatnonzero(np.any(np.abs(np.diff(points, axis=0)) > 1e-12, axis=1))
    if len(moving) == 0:
        return ways[-1:].repeat(2, axis=0)
    first, last = moving[0], moving[-1] + 1
    # A still point on both sides: the path begins and ends at rest.
    points = points[max(first - 1, 0) : last + 3].reshape(-1, 2, 7)
    points[0], points[-1] = ways[0], ways[-1]
    return points


def _excess(
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    limits: MotionLimits,
    dt: float,
) -> float:
    """By what factor time must be stretched for the shares of all limits to hold."""
    turned = poses.multiply(orientations[1:], poses.conjugate(orientations[:-1]))
    still = np.zeros((3, 2, 3))
    bounds = (
        (np.diff(positions, axis=0), (limits.speed, limits.acceleration, limits.jerk)),
        (
            poses.logarithm(turned),
            (limits.angular_speed, limits.angular_acceleration, limits.angular_jerk),
        ),
    )
    worst = 0.0
    for steps, limit in bounds:
        rate = np.concatenate([still, steps / dt, still])
        for order, bound in enumerate(limit, start=1):
            most = float(np.linalg.norm(rate, axis=2).max(initial=0.0))
            worst = max(worst, (most / (1.001 * PATH_LIMIT_SHARE * bound)) ** (1.0 / order))
            rate = np.diff(rate, axis=0) / dt
    return worst


def _unrolled(
    orientations: Float64[np.ndarray, "w 2 4"],
) -> tuple[Float64[np.ndarray, "2 4"], Float64[np.ndarray, "w 2 4"]]:
    """An orientation halfway, and what leads from it to each other one.

    A swing of the rope's axis [rad], then the angle about that axis [rad], which may be many turns.
    """
    middle = orientations[len(orientations) // 2]
    axis = np.broadcast_to(AXIS, (*middle.shape[:-1], 3))
    first = poses.rotate(middle, axis)
    swings = poses.rotation_between(
        np.broadcast_to(first, (*orientations.shape[:-1], 3)),
        poses.rotate(orientations, np.broadcast_to(AXIS, (*orientations.shape[:-1], 3))),
    )
    upright = poses.multiply(swings, np.broadcast_to(middle, orientations.shape))
    spins = poses.multiply(poses.conjugate(upright), orientations)
    angles = np.unwrap(2.0 * np.arctan2(spins[..., 3], spins[..., 0]), axis=0)
    return middle, np.concatenate([poses.logarithm(swings), angles[..., None]], axis=2)


def _rolled_up(
    middle: Float64[np.ndarray, "2 4"], angles: Float64[np.ndarray, "t 2 4"]
) -> Float64[np.ndarray, "t 2 4"]:
    """The orientations of `_unrolled`."""
    swung = poses.multiply(
        poses.exponential(angles[..., :3]), np.broadcast_to(middle, angles.shape)
    )
    return poses.normalized(poses.multiply(swung, poses.exponential(angles[..., 3:] * AXIS)))
