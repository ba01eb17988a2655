"""Kinematics of an arm, as far as the constraints need them."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose

Joints = Float64[np.ndarray, "j"]
"""Joint angles [rad]."""
SphereCover = tuple[Float64[np.ndarray, "*m k 3"], Float64[np.ndarray, "k"]]
"""Centres in the world frame and radii of k spheres, at m poses [m]."""


class ArmKinematics(Protocol):
    """Geometry of an arm."""

    joint_range: Float64[np.ndarray, "2 j"]
    """Least and largest angle of each joint [rad]."""
    max_joint_speed: Joints
    """Largest speed of each joint that the arm is built for; 0 where none is stated [rad/s]."""
    base_spheres: SphereCover
    """Spheres that cover the parts that do not move."""

    def link_spheres(self, path: Float64[np.ndarray, "m j"]) -> SphereCover:
        """Return spheres that cover the moving links along a path of the joints."""
        ...

    def grip(self, joints: Joints) -> Pose:
        """Return the grip pose in the world."""
        ...

    def solve(self, grip: Pose, near: Joints) -> Joints | None:
        """Return the joints for a grip pose in the world on the branch of `near`, if any."""
        ...

    def follow(
        self,
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
        near: Joints,
    ) -> Float64[np.ndarray, "m+1 j"] | None:
        """Return `near` and the joints along a path of the grip, each solved from those before.

        None when a pose is out of reach.
        """
        ...

    def smallest_singular_values(
        self, path: Float64[np.ndarray, "m j"]
    ) -> Float64[np.ndarray, "m"]:
        """Return the smallest singular value of the Jacobian along a path of the joints [m/rad]."""
        ...

    def joint_speed(self, joints: Joints, velocity: Float64[np.ndarray, "2 3"]) -> Joints:
        """Return the joint speeds for a twist of the grip in the world frame [rad/s]."""
        ...
