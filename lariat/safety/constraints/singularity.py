"""Singularity constraint: the Jacobian of an arm stays well conditioned (rule `singularity`)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.safety.constraints.arm_kinematics import ArmKinematics

MIN_SINGULAR_VALUE = 0.03
"""Least permitted singular value of the Jacobian in metres and radians [m/rad]; it is 0.21 at a
usual pose of a CR5 and 0 at a singular one."""


def singularity_slack(
    kinematics: ArmKinematics, joints: Float64[np.ndarray, "m j"]
) -> Float64[np.ndarray, "m"]:
    """Return by how much the least singular value exceeds its limit at m poses [m/rad]."""
    return kinematics.smallest_singular_values(joints) - MIN_SINGULAR_VALUE
