"""Errors of the grips: where the rope is held, relative to the grips that the arms report.

A gripper takes the rope a few millimetres aside and a few degrees askew. The error is fixed in the
frame of the grip: it travels and rotates with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import MotionState


@dataclass(frozen=True)
class GripErrors:
    """Pose of the rope's ends in the frames of the grips: left, right."""

    offsets: Float64[np.ndarray, "2 3"]
    """Positions [m]."""
    rotations: Float64[np.ndarray, "2 3"]
    """Rotation vectors [rad]."""

    @classmethod
    def none(cls) -> GripErrors:
        """Return exact grips."""
        return cls(np.zeros((2, 3)), np.zeros((2, 3)))

    @property
    def ends(self) -> tuple[Pose, Pose]:
        """Return the poses of the rope's ends in the frames of the grips: left, right."""
        left, right = map(Pose, self.offsets, poses.exponential(self.rotations))
        return left, right

    def held(self, grips: MotionState) -> MotionState:
        """Return the motion of the rope's ends; their accelerations are those of the grips.

        Args:
            grips: Motion of the grips that the arms report.
        """
        if not (self.offsets.any() or self.rotations.any()):
            return grips
        arms = poses.rotate(grips.orientations, self.offsets)
        turned = poses.multiply(grips.orientations, poses.exponential(self.rotations))
        twists = grips.twists.copy()
        twists[:, 0] += np.cross(twists[:, 1], arms)
        return MotionState(grips.positions + arms, turned, twists, grips.accelerations)
