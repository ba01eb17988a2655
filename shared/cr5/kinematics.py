"""Forward and inverse kinematics of the CR5 with its nominal geometry, `cr5.urdf`.

A real arm deviates from it by about a millimetre and a third of a degree. These joint angles serve
to check limits and singularities; the driver corrects them before it sends them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]  # its wheel lives beside site-packages
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose

URDF = Path(__file__).with_name("cr5.urdf")
"""Nominal geometry, with the collision cylinders of the links."""
JOINT_LIMIT_MARGIN = 0.035
"""Margin to the joint limits [rad]: the nominal geometry is wrong by up to 0.006."""
NEWTON_STEP_LIMIT = 0.5
"""Largest change of a joint in one Newton step [rad]."""
NEWTON_ITERATIONS = 30
"""Most Newton steps of the inverse kinematics."""
NEWTON_DAMPING = 1e-8
"""Damping of the normal equations of a Newton step."""
POSE_TOLERANCE = 1e-7
"""Error at which the inverse kinematics have converged [m, rad]."""

Joints = Float64[np.ndarray, "6"]
"""Joint angles [rad]."""


class Kinematics:
    """Kinematics of an arm at its place in the cell, with its tool."""

    def __init__(self, T_world_base: Pose, T_flange_grip: Pose) -> None:
        """Args: T_world_base: Pose of the base. T_flange_grip: Pose of the grip at the flange."""
        self._model = pinocchio.buildModelFromUrdf(str(URDF))
        self._data = self._model.createData()
        self._frame = self._model.getFrameId("link_6")
        self._T_world_base, self._T_flange_grip = T_world_base, T_flange_grip
        self._T_base_world, self._T_grip_flange = T_world_base.inverse(), T_flange_grip.inverse()
        self._se3_base_world = _to_se3(self._T_base_world)
        self._se3_grip_flange = _to_se3(self._T_grip_flange)
        self.joint_limits = np.array(self._model.upperPositionLimit) - JOINT_LIMIT_MARGIN
        """Largest allowed angle of each joint, either way [rad]."""
        links, base = _link_spheres(self._model)
        self._sphere_joints = [joint for joint, _, _ in links]
        counts = [len(centres) for _, centres, _ in links]
        self._sphere_rows = np.repeat(np.arange(len(links)), counts)
        """Index of each sphere's link among those with spheres."""
        self._sphere_centres = np.concatenate([centres for _, centres, _ in links])
        """Centres of the spheres in the frames of their joints [m]."""
        self._sphere_radii = np.repeat([radius for _, _, radius in links], counts)
        self.base_spheres = self._T_world_base.apply(base[0]), base[1]
        """Spheres that cover the base: centres in the world and radii [m]."""

    def flange(self, joints: Joints) -> Pose:
        """Return the pose of the flange in the base."""
        pinocchio.framesForwardKinematics(self._model, self._data, joints)
        return _from_se3(self._data.oMf[self._frame])

    def grip(self, joints: Joints) -> Pose:
        """Return the pose of the grip in the world."""
        return self.grip_of_flange(self.flange(joints))

    def grip_of_flange(self, flange: Pose) -> Pose:
        """Return the pose of the grip in the world, for one of the flange in the base."""
        return self._T_world_base @ flange @ self._T_flange_grip

    def flange_of_grip(self, grip: Pose) -> Pose:
        """Return the pose of the flange in the base, for one of the grip in the world."""
        return self._T_base_world @ grip @ self._T_grip_flange

    def grip_velocity(
        self, velocity: Float64[np.ndarray, "2 3"], flange: Pose
    ) -> Float64[np.ndarray, "2 3"]:
        """Return the twist of the grip in the world for one of the flange in the base."""
        linear, angular = poses.rotate(self._T_world_base.orientation, velocity)
        lever = poses.rotate(
            (self._T_world_base @ flange).orientation, self._T_flange_grip.position
        )
        return np.stack([linear + poses.cross(angular, lever), angular])

    def joint_speed(
        self, joints: Joints, velocity: Float64[np.ndarray, "2 3"]
    ) -> Float64[np.ndarray, "6"]:
        """Return the joint speeds for a twist of the grip in the world [rad/s]."""
        linear, angular = poses.rotate(self._T_base_world.orientation, velocity)
        flange = self.flange(joints)
        lever = poses.rotate(flange.orientation, self._T_flange_grip.position)
        twist = np.concatenate([linear - poses.cross(angular, lever), angular])
        return np.linalg.lstsq(self.jacobian(joints), twist, rcond=1e-6)[0]

    def jacobian(self, joints: Joints) -> Float64[np.ndarray, "6 6"]:
        """Return the Jacobian of the flange twist in the base, linear over angular [m/rad, -]."""
        return pinocchio.computeFrameJacobian(
            self._model,
            self._data,
            joints,
            self._frame,
            pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )

    def solve(self, grip: Pose, near: Joints) -> Joints | None:
        """Return the joints for a grip pose on the branch of `near`; None when out of reach.

        Damped Newton steps of bounded size on the logarithm of the pose error in SE(3).
        """
        goal = self._se3_base_world * _to_se3(grip) * self._se3_grip_flange
        joints = np.array(near, dtype=float)
        for _ in range(NEWTON_ITERATIONS):
            pinocchio.framesForwardKinematics(self._model, self._data, joints)
            error = pinocchio.log6(self._data.oMf[self._frame].actInv(goal)).vector
            if np.max(np.abs(error)) < POSE_TOLERANCE:
                return joints
            J = pinocchio.computeFrameJacobian(self._model, self._data, joints, self._frame)
            step = np.linalg.solve(J.T @ J + NEWTON_DAMPING * np.eye(6), J.T @ error)
            joints = joints + step * min(
                1.0, NEWTON_STEP_LIMIT / max(float(np.max(np.abs(step))), 1e-12)
            )
        return None

    def solve_anywhere(self, grip: Pose) -> Joints | None:
        """Return the joints for a grip pose on the branch farthest from singularities, or None."""
        found = []
        for shoulder in np.radians([-150.0, -90.0, -30.0, 30.0, 90.0, 150.0]):
            for elbow in np.radians([-100.0, 100.0]):
                for wrist in np.radians([-90.0, 90.0]):
                    seed = np.array([shoulder, 0.0, elbow, 0.0, wrist, 0.0])
                    joints = self.solve(grip, seed)
                    if joints is not None:
                        found.append((joints + np.pi) % (2.0 * np.pi) - np.pi)
        usable = [j for j in found if np.all(np.abs(j) <= self.joint_limits)]
        return max(usable, key=self.smallest_singular_value, default=None)

    def smallest_singular_value(self, joints: Joints) -> float:
        """Return the smallest singular value of the Jacobian, in metres and radians."""
        return float(np.linalg.svd(self.jacobian(joints), compute_uv=False)[-1])

    def link_spheres(
        self, path: Float64[np.ndarray, "m 6"]
    ) -> tuple[Float64[np.ndarray, "m k 3"], Float64[np.ndarray, "k"]]:
        """Return spheres that cover the moving links along a path of the joints.

        Args:
            path: Joints at m poses [rad].

        Returns:
            Centres in the world, and radii [m].
        """
        placements = np.empty((len(path), len(self._sphere_joints), 3, 4))
        for row, joints in zip(placements, path, strict=True):
            pinocchio.forwardKinematics(self._model, self._data, joints)
            for k, joint in enumerate(self._sphere_joints):
                row[k] = self._data.oMi[joint].homogeneous[:3]
        of_sphere = placements[:, self._sphere_rows]
        centres = np.einsum("mkij,kj->mki", of_sphere[..., :3], self._sphere_centres)
        return self._T_world_base.apply(centres + of_sphere[..., 3]), self._sphere_radii


def _to_se3(pose: Pose) -> pinocchio.SE3:
    w, x, y, z = (float(v) for v in pose.orientation)
    return pinocchio.SE3(pinocchio.Quaternion(w, x, y, z), np.asarray(pose.position, float))


def _from_se3(placement: pinocchio.SE3) -> Pose:
    return Pose(np.array(placement.translation), poses.from_matrix(np.array(placement.rotation)))


def _link_spheres(
    model: pinocchio.Model,
) -> tuple[list[tuple[int, np.ndarray, float]], tuple[np.ndarray, np.ndarray]]:
    """Create spheres that cover the collision cylinders of the links.

    Returns:
        Joint, centres in its frame and radius for each moving link; centres in the base and radii
        for the base.
    """
    geometry = pinocchio.buildGeomFromUrdf(model, str(URDF), pinocchio.GeometryType.COLLISION)
    rows = []
    for body in geometry.geometryObjects:
        half, radius = body.geometry.halfLength, body.geometry.radius
        reach = max(half - radius, 0.0)
        count = 1 + int(np.ceil(2.0 * reach / radius))
        along = np.linspace(-reach, reach, count)
        local = along[:, None] * np.array(body.placement.rotation)[:, 2] + np.array(
            body.placement.translation
        )
        gap = 2.0 * reach / max(count - 1, 1)
        rows.append((int(body.parentJoint), local, float(np.hypot(radius, gap / 2.0))))
    fixed = [(local, radius) for joint, local, radius in rows if joint == 0]
    base = (
        np.concatenate([np.zeros((0, 3)), *(local for local, _ in fixed)]),
        np.concatenate([np.zeros(0), *(np.full(len(local), r) for local, r in fixed)]),
    )
    return [row for row in rows if row[0] != 0], base
