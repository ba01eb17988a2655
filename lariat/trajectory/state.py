"""State of motion: poses, twists and accelerations of grippers at one moment.

All vectors are in the world frame. Of the middle axis of twists and accelerations, entry 0 is
translation and entry 1 rotation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose

Vectors = Float64[np.ndarray, "k 2 3"]
"""A linear and an angular vector for each of k grippers."""


@dataclass(frozen=True)
class MotionState:
    """Poses, twists and accelerations of k grippers at one moment, in the world frame."""

    positions: Float64[np.ndarray, "k 3"]
    """Positions [m]."""
    orientations: Float64[np.ndarray, "k 4"]
    """Unit quaternions, wxyz."""
    twists: Vectors
    """Linear and angular velocity [m/s, rad/s]."""
    accelerations: Vectors
    """Linear and angular acceleration [m/s^2, rad/s^2]."""

    @classmethod
    def at_rest(cls, *grips: Pose) -> MotionState:
        """Return the state of grippers that stand still.

        Args:
            grips: Pose of each gripper.
        """
        still = np.zeros((len(grips), 2, 3))
        return cls(
            np.array([grip.position for grip in grips], dtype=float).reshape(-1, 3),
            np.array([grip.orientation for grip in grips], dtype=float).reshape(-1, 4),
            still,
            still,
        )

    @property
    def grips(self) -> tuple[Pose, ...]:
        """Pose of each gripper."""
        return tuple(Pose(p, q) for p, q in zip(self.positions, self.orientations, strict=True))

    @property
    def resting(self) -> bool:
        """Whether all twists and accelerations are exactly zero."""
        return not (self.twists.any() or self.accelerations.any())

    def moved(self, displacements: Vectors, twists: Vectors, accelerations: Vectors) -> MotionState:
        """Return the state after a displacement.

        Args:
            displacements: Translation [m] and rotation vector [rad] of each gripper.
            twists: Twists after it [m/s, rad/s].
            accelerations: Accelerations after it [m/s^2, rad/s^2].
        """
        turned = poses.turned(displacements[:, 1], self.orientations)
        return MotionState(self.positions + displacements[:, 0], turned, twists, accelerations)


def mean_twists(before: MotionState, after: MotionState, dt: float) -> Vectors:
    """Return the mean twists between two states [m/s, rad/s].

    Args:
        dt: Time between the states [s].
    """
    twists = np.empty((len(after.positions), 2, 3))
    np.subtract(after.positions, before.positions, out=twists[:, 0])
    twists[:, 1] = poses.rotation_from(before.orientations, after.orientations)
    twists /= dt
    return twists
