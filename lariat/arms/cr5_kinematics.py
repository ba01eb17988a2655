"""Forward and inverse kinematics of the CR5 with its nominal geometry, `cr5.urdf`.

A real arm deviates from it by about a millimetre and a third of a degree. These joint angles serve
to check limits and singularities; the driver corrects them before it sends them.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.arms.description import CR5_FLANGE, CR5_URDF
from lariat.arms.kinematics import UrdfKinematics
from lariat.geometry.poses import Pose

JOINT_LIMIT_MARGIN = 0.035
"""Margin to the joint limits [rad]: the nominal geometry is wrong by up to 0.006."""


class Kinematics(UrdfKinematics):
    """Kinematics of a CR5 at its place in the cell, with its tool."""

    def __init__(self, T_world_base: Pose, T_flange_grip: Pose) -> None:
        """Args: T_world_base: Pose of the base. T_flange_grip: Pose of the grip at the flange."""
        super().__init__(CR5_URDF, CR5_FLANGE, T_world_base, T_flange_grip, JOINT_LIMIT_MARGIN)

    def _branch_seeds(self) -> Float64[np.ndarray, "s 6"]:
        return np.array(
            [
                [shoulder, 0.0, elbow, 0.0, wrist, 0.0]
                for shoulder in np.radians([-150.0, -90.0, -30.0, 30.0, 90.0, 150.0])
                for elbow in np.radians([-100.0, 100.0])
                for wrist in np.radians([-90.0, 90.0])
            ]
        )

    def _branch_rank(self, joints: Float64[np.ndarray, "6"]) -> float:
        # The ranges of a CR5 end beyond a whole turn.
        return float(self.smallest_singular_values(joints[None])[0])
