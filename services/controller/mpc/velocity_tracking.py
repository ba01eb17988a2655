"""Jerk-limited tracking of a wanted velocity in equal periods.

The jerk is constant in each period, so a limit on acceleration that holds at its ends holds within
it.
"""

from __future__ import annotations

import numpy as np

from lariat.trajectory import MotionLimits, clipped
from lariat.trajectory.limits import norms
from lariat.trajectory.state import Vectors

VELOCITY_GAIN = 0.3
"""Share of a small velocity error that is corrected in one period [-]."""


def jerk_towards(
    velocity: Vectors,
    acceleration: Vectors,
    wanted: Vectors,
    wanted_change: Vectors,
    limits: MotionLimits,
    dt: float,
) -> Vectors:
    """Return the jerk in the next period that leads the velocity to a wanted one.

    The wanted acceleration is proportional to a small velocity error and to the square root of a
    large one, so that the limited jerk can bring it back to zero in time.

    Args:
        velocity: Present velocities [m/s, rad/s].
        acceleration: Present accelerations [m/s^2, rad/s^2].
        wanted: Wanted velocities [m/s, rad/s].
        wanted_change: Rates of change of the wanted velocities, as feed-forward [m/s^2, rad/s^2].
        limits: Limits on speed, acceleration and jerk.
        dt: Duration of the period [s].

    Returns:
        Constant jerks [m/s^3, rad/s^3].
    """
    error = clipped(wanted, limits.speed_bounds) - velocity
    size = np.maximum(norms(error), 1e-12)
    gain = np.minimum(VELOCITY_GAIN / dt, np.sqrt(limits.jerk_bounds / size))
    target = clipped(wanted_change + gain * error, limits.acceleration_bounds)
    return clipped((target - acceleration) / dt, limits.jerk_bounds)
