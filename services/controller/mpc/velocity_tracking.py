"""Jerk-limited tracking of wanted velocities in equal periods.

The jerk is constant in each period, so a limit on acceleration that holds at its ends holds within
it. Vectors of three are computed as plain numbers, in a small part of the time of NumPy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float64

from lariat.trajectory import MotionLimits
from lariat.trajectory.state import Vectors

VELOCITY_GAIN = 0.3
"""Share of a small velocity error that is corrected in one period [-]."""


@dataclass(frozen=True)
class TrackedMotion:
    """Displacements, velocities and accelerations of k grippers at the ends of t periods."""

    displacements: Float64[np.ndarray, "t k 2 3"]
    """Translations [m] and rotation vectors [rad]."""
    velocities: Float64[np.ndarray, "t k 2 3"]
    """Velocities [m/s, rad/s]."""
    accelerations: Float64[np.ndarray, "t k 2 3"]
    """Accelerations [m/s^2, rad/s^2]."""


def track(
    displacement: Vectors,
    velocity: Vectors,
    acceleration: Vectors,
    wanted: Float64[np.ndarray, "t+1 k 2 3"],
    limits: MotionLimits,
    dt: float,
) -> TrackedMotion:
    """Return the motion that follows wanted velocities.

    The wanted acceleration is proportional to a small velocity error and to the square root of a
    large one, so that the limited jerk can bring it back to zero in time.

    Args:
        displacement: Present displacements [m, rad].
        velocity: Present velocities [m/s, rad/s].
        acceleration: Present accelerations [m/s^2, rad/s^2].
        wanted: Wanted velocities, at present and at the end of each period [m/s, rad/s]; their
            changes are fed forward.
        limits: Limits on speed, acceleration and jerk.
        dt: Duration of a period [s].
    """
    motion = np.zeros((len(wanted) - 1, len(velocity), 2, 3, 3))
    motion[:, :, :, 0] = displacement
    starts = np.stack([displacement, velocity, acceleration], axis=2).tolist()
    aims = np.moveaxis(wanted, 0, 2).tolist()
    kinds = np.hstack([limits.speed_bounds, limits.acceleration_bounds, limits.jerk_bounds])
    for end, (begun, wished) in enumerate(zip(starts, aims, strict=True)):
        for kind, bounds in enumerate(kinds.tolist()):
            if any(map(any, (*begun[kind][1:], *wished[kind]))):
                motion[:, end, kind] = _track_vector(begun[kind], wished[kind], bounds, dt)
    return TrackedMotion(*np.moveaxis(motion, 3, 0))


def _track_vector(
    start: list[list[float]], aims: list[list[float]], bounds: list[float], dt: float
) -> list[tuple[tuple[float, float, float], ...]]:
    """Displacement, velocity and acceleration of one vector at the end of each period."""
    (px, py, pz), (vx, vy, vz), (ax, ay, az) = start
    speed, acceleration, jerk = bounds
    motion = []
    for (wx, wy, wz), (nx, ny, nz) in pairwise(aims):
        cx, cy, cz = (nx - wx) / dt, (ny - wy) / dt, (nz - wz) / dt
        wx, wy, wz = shortened(wx, wy, wz, speed)
        ex, ey, ez = wx - vx, wy - vy, wz - vz
        size = max(math.sqrt(ex * ex + ey * ey + ez * ez), 1e-12)
        gain = min(VELOCITY_GAIN / dt, math.sqrt(jerk / size))
        tx, ty, tz = shortened(cx + gain * ex, cy + gain * ey, cz + gain * ez, acceleration)
        jx, jy, jz = shortened((tx - ax) / dt, (ty - ay) / dt, (tz - az) / dt, jerk)
        px = px + dt * (vx + dt * (ax / 2.0 + dt * jx / 6.0))
        py = py + dt * (vy + dt * (ay / 2.0 + dt * jy / 6.0))
        pz = pz + dt * (vz + dt * (az / 2.0 + dt * jz / 6.0))
        vx = vx + dt * (ax + dt * jx / 2.0)
        vy = vy + dt * (ay + dt * jy / 2.0)
        vz = vz + dt * (az + dt * jz / 2.0)
        ax, ay, az = ax + dt * jx, ay + dt * jy, az + dt * jz
        motion.append(((px, py, pz), (vx, vy, vz), (ax, ay, az)))
    return motion


def shortened(x: float, y: float, z: float, bound: float) -> tuple[float, float, float]:
    """Return a vector of plain numbers, shortened to a bound on its norm."""
    share = min(1.0, bound / max(math.sqrt(x * x + y * y + z * z), 1e-300))
    return x * share, y * share, z * share
