"""Jerk-limited tracking of a wanted velocity on a grid of instants.

Between two instants the jerk is constant, so limits that hold at the instants hold everywhere.
"""

from __future__ import annotations

import numpy as np

from lariat.trajectory import MotionLimits, clipped
from lariat.trajectory.limits import norms
from lariat.trajectory.state import Vectors


def jerk_towards(
    velocity: Vectors,
    acceleration: Vectors,
    wanted: Vectors,
    wanted_change: Vectors,
    limits: MotionLimits,
    dt: float,
) -> Vectors:
    """Return the constant jerk over the next `dt` [s] that leads the velocity to a wanted one.

    The error in velocity asks for an acceleration, linear near zero and as its square root further
    out, so that the jerk can always take it away again in time.

    Args:
        wanted: Velocity to lead to.
        wanted_change: Its rate of change, as feed-forward.
    """
    error = clipped(wanted, limits.speed_bounds) - velocity
    size = np.maximum(norms(error), 1e-12)
    gain = np.minimum(0.3 / dt, np.sqrt(limits.jerk_bounds / size))
    asked = clipped(wanted_change + gain * error, limits.acceleration_bounds)
    return clipped((asked - acceleration) / dt, limits.jerk_bounds)
