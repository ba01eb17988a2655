"""Time parameterization of a path of grips: from rest to rest, within the grippers' limits.

The waypoints are first passed at constant speed. Two running means over time then round the
corners: the first bounds the acceleration by the change of velocity over its width, the second
bounds the jerk by the change of acceleration over its own. The path waits at its first and its
last point, so that the means do not move them. Where there is little room, corners are passed more
slowly, so that the means cut less of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grips import Grips
from lariat.safety.motion_contract import PATH_LIMIT_SHARE
from lariat.trajectory import MotionLimits

ROPE_AXIS = np.array([0.0, 0.0, 1.0])
"""Axis of the rope in the frame of a grip."""
LIMIT_TOLERANCE = 1.001
"""Factor by which a limit may be exceeded."""
MAX_STRETCHES = 3
"""Number of times that a path that exceeds a limit is slowed down."""
STRETCH_MARGIN = 1.02
"""Factor on the stretch that such a path requires."""
CORNER_LEVER = 0.05
"""Lever arm that converts a grip's rotation into a displacement of the rope beside it [m]."""
MIN_CUT = 1e-4
"""Distance by which any corner may be cut [m]."""
MAX_CORNER_SLOWDOWN = 12.0
"""Largest factor by which a corner is passed more slowly [-]."""
STILL_STEP = 1e-12
"""Change of a coordinate from point to point up to which the path is at rest [m] or [rad]."""


@dataclass(frozen=True)
class Pace:
    """Speed of a path, and the smoothing of its corners."""

    slowdown: float = 1.0
    """Factor by which it is slower than the limits allow; at least 1."""
    mean_widths: tuple[float, float] = (0.24, 0.10)
    """Widths of the two running means, before they are stretched by the slowdown [s]. A mean as
    wide as the period of the rope's swing does not excite it."""
    cut_share: float = np.inf
    """Share of the room at a waypoint by which the means may cut its corner; infinite where corners
    are not slowed down for it [-]."""


def time_parameterize(
    waypoints: Grips,
    limits: MotionLimits,
    dt: float,
    pace: Pace,
    room: Float64[np.ndarray, "w"] | None = None,
) -> Grips:
    """Return both grips at constant time steps on their way through waypoints.

    Args:
        limits: Limits of speed, acceleration and jerk, of which the path uses a share
            (`lariat.safety.motion_contract.PATH_LIMIT_SHARE`).
        dt: Time between points [s].
        pace: Speed and smoothing; the path is slower where the limits require it.
        room: Distance by which the rope may leave the path at each waypoint [m].
    """
    middle, angles = _swing_and_twist(waypoints.orientations)
    columns = np.concatenate([waypoints.positions, angles], axis=2)
    steps = waypoints.steps()
    far = np.linalg.norm(steps.reshape(-1, 2, 2, 3), axis=3).max(axis=1)
    least = np.max(far / limits.speed_bounds[:, 0], axis=1)
    if room is not None and np.isfinite(pace.cut_share):
        least = least * _corner_slowdown(steps, least, pace, room)
    stretch = pace.slowdown
    for _ in range(MAX_STRETCHES):
        path = _at_pace(columns, middle, least, stretch, dt, pace)
        excess = _required_stretch(path, limits, dt)
        if excess <= 1.0:
            return path
        stretch *= STRETCH_MARGIN * excess
    return _at_pace(columns, middle, least, stretch, dt, pace)


def _at_pace(
    waypoints: Float64[np.ndarray, "w 2 7"],
    middle: Float64[np.ndarray, "2 4"],
    least: Float64[np.ndarray, "w-1"],
    stretch: float,
    dt: float,
    pace: Pace,
) -> Grips:
    """Smoothed path with its durations and means stretched by a factor."""
    widths = [width * stretch for width in pace.mean_widths]
    points = _smoothed(waypoints, least * stretch, dt, widths)
    return Grips(points[..., :3], _orientations(middle, points[..., 3:]))


def _corner_slowdown(
    steps: Float64[np.ndarray, "w-1 2 6"],
    least: Float64[np.ndarray, "w-1"],
    pace: Pace,
    room: Float64[np.ndarray, "w"],
) -> Float64[np.ndarray, "w-1"]:
    """Factors on the durations between waypoints with which no corner is cut by too much."""
    moves = steps * np.repeat([1.0, CORNER_LEVER], 3)
    velocities = moves / np.maximum(least / PATH_LIMIT_SHARE, 1e-6)[:, None, None]
    # Its first and its last point are no corners: the path waits there.
    change = np.linalg.norm(np.diff(velocities, axis=0), axis=2).max(axis=1)
    # A mean of width b takes a corner of velocity change v off by v b / 8. It widens with the
    # slowdown as much as the speed decreases.
    cut = np.concatenate([[0.0], change * sum(pace.mean_widths) / 8.0, [0.0]])
    factors = np.clip(cut / np.maximum(pace.cut_share * room, MIN_CUT), 1.0, MAX_CORNER_SLOWDOWN)
    return np.maximum(factors[1:], factors[:-1])


def _smoothed(
    waypoints: Float64[np.ndarray, "w 2 7"],
    durations: Float64[np.ndarray, "w-1"],
    dt: float,
    mean_widths: list[float],
) -> Float64[np.ndarray, "t 2 7"]:
    """Path through waypoints at constant speed between them, smoothed by running means."""
    times = np.concatenate([[0.0], np.cumsum(durations / PATH_LIMIT_SHARE)])
    widths = [max(1, round(mean / dt)) for mean in mean_widths]
    wait = sum(widths)
    count = int(np.ceil(times[-1] / dt)) + 1
    at = dt * np.arange(-wait, count + wait)
    flat = waypoints.reshape(len(waypoints), 14)
    points = np.stack([np.interp(at, times, column) for column in flat.T], axis=1)
    for width in widths:
        sums = np.cumsum(np.concatenate([np.zeros((1, 14)), points]), axis=0)
        points = (sums[width:] - sums[:-width]) / width
    moving = np.flatnonzero(np.any(np.abs(np.diff(points, axis=0)) > STILL_STEP, axis=1))
    if len(moving) == 0:
        return waypoints[-1:].repeat(2, axis=0)
    first, last = moving[0], moving[-1] + 1
    # One point at rest on both sides: the path begins and ends at rest.
    points = points[max(first - 1, 0) : last + 3].reshape(-1, 2, 7)
    points[0], points[-1] = waypoints[0], waypoints[-1]
    return points


def _required_stretch(path: Grips, limits: MotionLimits, dt: float) -> float:
    """Factor by which time must be stretched for the path to keep its share of all limits."""
    still = np.zeros((3, 2, 2, 3))
    rate = np.concatenate([still, path.steps().reshape(-1, 2, 2, 3) / dt, still])
    worst = 0.0
    bounds = limits.speed_bounds, limits.acceleration_bounds, limits.jerk_bounds
    for order, bound in enumerate(bounds, start=1):
        most = np.linalg.norm(rate, axis=3).max(axis=(0, 1))
        share = most / (LIMIT_TOLERANCE * PATH_LIMIT_SHARE * bound[:, 0])
        worst = max(worst, float(np.max(share)) ** (1.0 / order))
        rate = np.diff(rate, axis=0) / dt
    return worst


def _swing_and_twist(
    orientations: Float64[np.ndarray, "w 2 4"],
) -> tuple[Float64[np.ndarray, "2 4"], Float64[np.ndarray, "w 2 4"]]:
    """Orientation halfway, and the swing and twist from it to each orientation.

    A swing is a rotation vector of the rope's axis [rad], a twist the angle about that axis [rad],
    which may exceed whole turns.
    """
    middle = orientations[len(orientations) // 2]
    axis = np.broadcast_to(ROPE_AXIS, (*middle.shape[:-1], 3))
    first = poses.rotate(middle, axis)
    swings = poses.rotation_between(
        np.broadcast_to(first, (*orientations.shape[:-1], 3)),
        poses.rotate(orientations, np.broadcast_to(ROPE_AXIS, (*orientations.shape[:-1], 3))),
    )
    upright = poses.multiply(swings, np.broadcast_to(middle, orientations.shape))
    spins = poses.multiply(poses.conjugate(upright), orientations)
    angles = np.unwrap(2.0 * np.arctan2(spins[..., 3], spins[..., 0]), axis=0)
    return middle, np.concatenate([poses.logarithm(swings), angles[..., None]], axis=2)


def _orientations(
    middle: Float64[np.ndarray, "2 4"], angles: Float64[np.ndarray, "t 2 4"]
) -> Float64[np.ndarray, "t 2 4"]:
    """Orientations of swings and twists from `_swing_and_twist`."""
    swung = poses.multiply(
        poses.exponential(angles[..., :3]), np.broadcast_to(middle, angles.shape)
    )
    return poses.normalized(poses.multiply(swung, poses.exponential(angles[..., 3:] * ROPE_AXIS)))
