"""Jerk-limited tracking of wanted velocities in equal periods.

The jerk is constant in each period, so a limit on acceleration that holds at its ends holds within
it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.control.mpc.motion_kernels import bounds_of, kernel, rows_of
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
    targets: Float64[np.ndarray, "t+1 k 2 3"],
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
        targets: Wanted velocities, at present and at the end of each period [m/s, rad/s]; their
            changes are fed forward.
        limits: Limits on speed, acceleration and jerk.
        dt: Duration of a period [s].
    """
    shape = (3, len(targets) - 1, *velocity.shape)
    motion = np.empty((math.prod(shape[:-1]), 3))
    present = rows_of(displacement), rows_of(velocity), rows_of(acceleration)
    follow = kernel("track_velocities")
    follow(*present, rows_of(targets), bounds_of(limits), motion, VELOCITY_GAIN, dt)
    return TrackedMotion(*motion.reshape(shape))
