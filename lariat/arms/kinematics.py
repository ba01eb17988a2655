"""Kinematics and collision bodies of an arm that a URDF describes, by Pinocchio.

Joint angles are those of the joints from the URDF's root to the flange, in that order; all other
joints are locked at zero, or at the nearest angle that they can take. Of the solutions of an arm
with more than six joints, the one nearest to its posture counts, so that the joints are a function
of the grip's pose and do not drift.
"""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]  # its wheel lives beside site-packages
from jaxtyping import Float64

from lariat.arms.path_kernel import MOST_JOINTS, SPEED_CUTOFF, ArmPath, PathKernel
from lariat.arms.serial_chain import SerialChain
from lariat.arms.sphere_cover import Cover, sphere_cover
from lariat.arms.urdf import ANGULAR_JOINTS, Urdf, read_robot
from lariat.files.library_output import kept_prints
from lariat.geometry import poses
from lariat.geometry.poses import Pose

NEWTON_STEP_LIMIT = 0.5
"""Largest change of a joint in one Newton step [rad]."""
NEWTON_ITERATIONS = 30
"""Most Newton steps of the inverse kinematics."""
NEWTON_DAMPING = 1e-8
"""Damping of the normal equations of a Newton step."""
POSE_TOLERANCE = 1e-7
"""Error at which the inverse kinematics have converged [m, rad]."""
POSTURE_ITERATIONS = 20
"""Most Newton steps that also approach the posture."""
BRANCH_SEEDS = 60
"""Number of random joint angles from which branches of the inverse kinematics are sought."""
BRANCH_LIMIT_MARGIN = 0.5
"""Distance from the nearest joint limit below which a branch is worth less [rad]."""
POSTURE_TOLERANCE = 1e-4
"""Motion towards the posture, without moving the grip, below which it has converged [rad]."""

MAX_JOINT_ANGLE = 4.0 * math.pi
"""Largest limit of a joint that is taken for radians [rad]."""
MAX_JOINT_DISTANCE = 10.0
"""Largest distance of a joint from its link that is taken for metres [m]."""
CONTINUOUS_RANGE = 2.0 * math.pi
"""Largest angle of a joint without limits, in each direction [rad]."""
UNSTATED_LIMITS = {"effort": "100", "velocity": "2"}
"""Torque [N m] and speed [rad/s] of a joint for which the description states none, or zero."""

Joints = Float64[np.ndarray, "j"]
"""Joint angles [rad]."""


class UrdfKinematics:
    """Kinematics of an arm at its place in the cell, with its tool."""

    def __init__(
        self,
        urdf: Path,
        flange: str,
        T_world_base: Pose,
        T_flange_grip: Pose,
        limit_margin: float = 0.0,
    ) -> None:
        """Create the kinematics of an arm.

        Args:
            urdf: Description of the arm; `package://` is looked for above it and as in ROS.
            flange: Link that carries the tool.
            T_world_base: Pose of the URDF's root in the world.
            T_flange_grip: Pose of the grip at the flange.
            limit_margin: Margin to the joint limits of the URDF [rad].

        Raises:
            ValueError: The file cannot be read, has no such link, or a joint of the arm does not
                turn between two limits.
        """
        self._model, geometry = load_arm(urdf, flange)
        self._data = self._model.createData()
        self._frame = self._model.getFrameId(flange, pinocchio.FrameType.BODY)
        self._chain = SerialChain(self._model, self._frame)
        self._T_world_base, self._T_flange_grip = T_world_base, T_flange_grip
        self._T_base_world, self._T_grip_flange = T_world_base.inverse(), T_flange_grip.inverse()
        self._R_base_world = poses.matrix(self._T_base_world.orientation)
        self._se3_base_world = _to_se3(self._T_base_world)
        self._se3_grip_flange = _to_se3(self._T_grip_flange)
        low = np.array(self._model.lowerPositionLimit) + limit_margin
        high = np.array(self._model.upperPositionLimit) - limit_margin
        self.joint_range: Float64[np.ndarray, "2 j"] = np.stack([low, high])
        """Least and largest allowed angle of each joint [rad]."""
        self.max_joint_speed: Joints = np.array(self._model.velocityLimit)
        """Largest speed of each joint that the arm is built for [rad/s]."""
        covers = [(int(body.parentJoint), sphere_cover(body)) for body in geometry.geometryObjects]
        links = [(joint, cover) for joint, cover in covers if joint != 0]
        self._sphere_joints = [joint for joint, _ in links]
        counts = [len(radii) for _, (_, radii) in links]
        self._sphere_rows = np.repeat(np.arange(len(links)), counts)
        """Index of each sphere's link among those with spheres."""
        self._sphere_columns = np.repeat(np.array(self._sphere_joints, dtype=int) - 1, counts)
        """Index of each sphere's joint in the chain."""
        self._sphere_centres, self._sphere_radii = _joined([cover for _, cover in links])
        """Spheres in the frames of their joints: centres and radii [m]."""
        centres, radii = _joined([cover for joint, cover in covers if joint == 0])
        self.base_spheres = self._T_world_base.apply(centres), radii
        """Spheres that cover the base: centres in the world and radii [m]."""

        self._damping = NEWTON_DAMPING * np.eye(self._model.nq)
        self.posture: Joints | None = None
        """Joint angles near which an arm with more than six joints stays [rad]."""
        self._kernel: PathKernel | None = None
        self._latest: ArmPath | None = None
        """Path that the kernel followed last: a check asks for its links and singularity."""

    def compile(self) -> None:
        """Solve paths by compiled code from now on, where it knows such an arm."""
        if self.joint_count <= MOST_JOINTS:
            self._kernel = PathKernel(
                self._chain.joints,
                (
                    self._chain.flange,
                    self._T_base_world,
                    self._T_grip_flange,
                    self._T_world_base,
                ),
                (self._sphere_columns, self._sphere_centres),
                (NEWTON_DAMPING, NEWTON_STEP_LIMIT, POSE_TOLERANCE, NEWTON_ITERATIONS),
            )

    @property
    def model(self) -> pinocchio.Model:
        """Pinocchio's model of the arm, without the joints that are locked."""
        return self._model

    @property
    def joint_count(self) -> int:
        """Number of joints."""
        return self._model.nq

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
        lever = poses.rotate(flange.orientation, self._T_flange_grip.position)
        angular = velocity[1]
        twist = np.array([velocity[0] + poses.cross(angular, lever), angular])
        return twist @ self._R_base_world

    def grip_wrench(
        self, wrench: Float64[np.ndarray, "2 3"], flange: Pose
    ) -> Float64[np.ndarray, "2 3"]:
        """Return the wrench about the grip in the world for one about the flange in the base."""
        lever = poses.rotate(flange.orientation, self._T_flange_grip.position)
        force, torque = wrench
        return np.array([force, torque - poses.cross(lever, force)]) @ self._R_base_world

    def joint_speed(self, joints: Joints, velocity: Float64[np.ndarray, "2 3"]) -> Joints:
        """Return the joint speeds for a twist of the grip in the world [rad/s]."""
        if self._kernel is not None:
            return self._kernel.joint_speed(joints, velocity)
        linear, angular = velocity @ self._R_base_world.T
        jacobian = self.jacobian(joints)
        lever = self._data.oMf[self._frame].rotation @ self._T_flange_grip.position
        twist = np.concatenate([linear - poses.cross(angular, lever), angular])
        return np.linalg.lstsq(jacobian, twist, rcond=SPEED_CUTOFF)[0]

    def jacobian(self, joints: Joints) -> Float64[np.ndarray, "6 j"]:
        """Return the Jacobian of the flange twist in the base, linear over angular [m/rad, -]."""
        return pinocchio.computeFrameJacobian(
            self._model,
            self._data,
            joints,
            self._frame,
            pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        ).reshape(6, -1)

    def grip_jacobian(self, joints: Joints) -> Float64[np.ndarray, "6 j"]:
        """Return the Jacobian of the grip's twist in the world, linear over angular [m/rad, -]."""
        lever = poses.rotate(self.flange(joints).orientation, self._T_flange_grip.position)
        linear, angular = np.split(self.jacobian(joints).T, 2, axis=1)
        linear = linear + poses.cross(angular, np.broadcast_to(lever, angular.shape))
        base = self._T_world_base.orientation
        return np.hstack([poses.rotate(base, linear), poses.rotate(base, angular)]).T

    def link_sphere_jacobians(self, joints: Joints) -> Float64[np.ndarray, "k 3 j"]:
        """Return the derivatives of the centres of `link_spheres` by the joints [m/rad]."""
        pinocchio.computeJointJacobians(self._model, self._data, joints)
        jacobians = np.zeros((len(self._sphere_rows), 3, self._model.nq))
        for k, joint in enumerate(self._sphere_joints):
            (rows,) = np.nonzero(self._sphere_rows == k)
            columns = pinocchio.getJointJacobian(
                self._model, self._data, joint, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            linear, angular = np.split(columns.T, 2, axis=1)
            levers = self._sphere_centres[rows] @ np.array(self._data.oMi[joint].rotation).T
            shape = (len(levers), *angular.shape)
            turning = poses.cross(
                np.broadcast_to(angular, shape), np.broadcast_to(levers[:, None], shape)
            )
            moved = poses.rotate(self._T_world_base.orientation, linear + turning)
            jacobians[rows] = np.swapaxes(moved, 1, 2)
        return jacobians

    def solve(self, grip: Pose, near: Joints) -> Joints | None:
        """Return the joints for a grip pose on the branch of `near`; None when out of reach.

        Damped Newton steps of bounded size on the logarithm of the pose error in SE(3).
        """
        if self._kernel is not None:
            return self._kernel.solve(grip.position, grip.orientation, near)
        goal = self._se3_base_world * _to_se3(grip) * self._se3_grip_flange
        joints = np.array(near, dtype=float)
        damping = self._damping
        posture = self.posture if len(joints) > 6 else None
        for iteration in range(NEWTON_ITERATIONS):
            pinocchio.framesForwardKinematics(self._model, self._data, joints)
            error = pinocchio.log6(self._data.oMf[self._frame].actInv(goal)).vector
            reached = _largest(error) < POSE_TOLERANCE
            if reached and posture is None:
                return joints
            J = pinocchio.computeFrameJacobian(self._model, self._data, joints, self._frame)
            # Of an arm of one joint it is a vector.
            J = J.reshape(6, -1)
            step = np.linalg.solve(J.T @ J + damping, J.T @ error)
            if posture is not None:
                to_posture = posture - joints
                free = to_posture - J.T @ np.linalg.solve(J @ J.T + damping[:6, :6], J @ to_posture)
                if reached and np.max(np.abs(free)) < POSTURE_TOLERANCE:
                    return joints
                step = step + free
                if iteration == POSTURE_ITERATIONS:
                    # Near enough: the rest of the steps is for the pose alone.
                    posture = None
            joints = joints + step * min(1.0, NEWTON_STEP_LIMIT / max(_largest(step), 1e-12))
        return None

    def follow(
        self,
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
        near: Joints,
    ) -> Float64[np.ndarray, "m+1 j"] | None:
        """Return the joints along a path of the grip, each solved from those before.

        Args:
            positions: Positions of the grip [m].
            orientations: Its orientations, wxyz.
            near: Joints at the beginning, which the path begins with [rad].
        """
        if self._kernel is not None:
            self._latest = self._kernel.follow(positions, orientations, near)
            return None if self._latest is None else self._latest.joints
        rows = [near]
        for pose in map(Pose, positions, orientations):
            joints = self.solve(pose, rows[-1])
            if joints is None:
                return None
            rows.append(joints)
        return np.array(rows)

    def solve_anywhere(self, grip: Pose) -> Joints | None:
        """Return the joints for a grip pose on the branch farthest from singularities, or None.

        A branch within `BRANCH_LIMIT_MARGIN` of a joint limit is worth less.
        """
        low, high = self.joint_range
        # Of the many solutions of a redundant arm, the one in the middle of its ranges.
        solutions, self.posture = [], 0.5 * (low + high)
        for seed in self._branch_seeds():
            joints = self.solve(grip, seed)
            if joints is not None:
                joints = (joints + np.pi) % (2.0 * np.pi) - np.pi
                if np.all((joints >= low) & (joints <= high)):
                    solutions.append(joints)
        best = max(solutions, key=self._branch_rank, default=None)
        self.posture = best
        return best

    def _branch_rank(self, joints: Joints) -> float:
        """Worth of a branch: distance from singularities, less near a joint limit."""
        low, high = self.joint_range
        margin = float(np.min(np.minimum(joints - low, high - joints)))
        room = min(1.0, margin / BRANCH_LIMIT_MARGIN)
        return room * float(self.smallest_singular_values(joints[None])[0])

    def _branch_seeds(self) -> Float64[np.ndarray, "s j"]:
        """Joint angles from which branches are sought: the middle of the range, and random ones."""
        low, high = (np.clip(limit, -np.pi, np.pi) for limit in self.joint_range)
        random = np.random.default_rng(0)
        return np.vstack([0.5 * (low + high), random.uniform(low, high, (BRANCH_SEEDS, len(low)))])

    def smallest_singular_values(
        self, path: Float64[np.ndarray, "m j"]
    ) -> Float64[np.ndarray, "m"]:
        """Return the smallest singular value of the Jacobian along a path of the joints [m/rad].

        Of the path that the kernel followed last, values from `EXACT_SINGULAR_VALUE` on are lower
        bounds of as much.
        """
        if self._latest is not None and path is self._latest.joints:
            return self._latest.singular_values
        return np.linalg.svd(self._chain.jacobians(path), compute_uv=False)[:, -1]

    def link_spheres(
        self, path: Float64[np.ndarray, "m j"]
    ) -> tuple[Float64[np.ndarray, "m k 3"], Float64[np.ndarray, "k"]]:
        """Return spheres that cover the moving links along a path of the joints.

        Args:
            path: Joints at m poses [rad].

        Returns:
            Centres in the world, and radii [m].
        """
        if self._latest is not None and path is self._latest.joints:
            return self._latest.centres, self._sphere_radii
        of_sphere = self._chain.placements(path)[:, self._sphere_columns, :3]
        centres = np.einsum("mkij,kj->mki", of_sphere[..., :3], self._sphere_centres)
        return self._T_world_base.apply(centres + of_sphere[..., 3]), self._sphere_radii


def _largest(vector: Float64[np.ndarray, "k"]) -> float:
    """Return the largest absolute component of a short vector; without NumPy it takes a fifth."""
    return max(map(abs, vector.tolist()))


def _joined(covers: list[Cover]) -> Cover:
    """Spheres of all covers together."""
    centres = np.concatenate([np.zeros((0, 3)), *(centres for centres, _ in covers)])
    return centres, np.concatenate([np.zeros(0), *(radii for _, radii in covers)])


def load_arm(urdf: Path, flange: str) -> tuple[pinocchio.Model, pinocchio.GeometryModel]:
    """Return model and collision bodies of the joints from the root to a link, all others locked.

    Args:
        urdf: Description of the arm; `package://` is looked for above it and as in ROS.
        flange: Link that carries the tool.

    Raises:
        ValueError: See `UrdfKinematics`.
    """
    if not urdf.is_file():
        raise ValueError(f"there is no URDF {urdf}")
    text = _with_limits(urdf, flange)
    printed: list[str] = []
    try:
        with kept_prints() as printed:
            model = pinocchio.buildModelFromXML(text)
            geometry = pinocchio.buildGeomFromUrdfString(
                model,
                text,
                pinocchio.GeometryType.COLLISION,
                # Pinocchio adds the folders of ROS_PACKAGE_PATH and AMENT_PREFIX_PATH.
                package_dirs=[str(folder) for folder in urdf.resolve().parents],
            )
    except ValueError as error:
        # The parser of the URDF prints its reason, that of a mesh ends with it.
        reasons = [line.removeprefix("Error:") for line in printed if line.startswith("Error:")]
        reason = " ".join((reasons or [str(error).rpartition("message: ")[2]])[0].split())
        hint = "; put its package above the URDF or name its folder in ROS_PACKAGE_PATH"
        missing = "could not be found" in reason
        raise ValueError(
            f"{urdf} cannot be read as a URDF: {reason.rstrip('. ')}{hint if missing else ''}"
        ) from error
    joint = model.frames[model.getFrameId(flange, pinocchio.FrameType.BODY)].parentJoint
    arm = {int(each) for each in model.supports[joint]} - {0}
    locked = [k for k in range(1, model.njoints) if k not in arm]
    rest = np.clip(pinocchio.neutral(model), model.lowerPositionLimit, model.upperPositionLimit)
    model, geometry = pinocchio.buildReducedModel(model, geometry, locked, rest)
    return model, geometry


def _with_limits(urdf: Path, flange: str) -> str:
    """Text of a URDF in which continuous joints turn twice at most, once in each direction.

    Joints between root and flange are checked: what Pinocchio takes for granted of them.
    """
    robot = read_robot(urdf)
    links = [link.get("name", "") for link in robot.iterfind("link")]
    if flange not in links:
        raise ValueError(f"{urdf} has no link {flange!r}; its links are {', '.join(links)}")
    chain = {joint.name: joint for joint in Urdf(urdf).chain(flange)}
    if not chain:
        raise ValueError(f"no joint of {urdf} moves {flange!r}; give the link that holds the tool")
    for joint in robot.iterfind("joint"):
        name, kind, limit = joint.get("name", ""), joint.get("type"), joint.find("limit")
        if name in links:
            # Pinocchio confuses a joint with a link of its name.
            joint.set("name", f"{name}_joint")
        if kind == "continuous":
            joint.set("type", "revolute")
            limit = ElementTree.SubElement(joint, "limit") if limit is None else limit
            limit.attrib |= {"lower": f"{-CONTINUOUS_RANGE}", "upper": f"{CONTINUOUS_RANGE}"}
        where = f"joint {name!r} of {urdf}"
        if limit is not None:
            for key, value in UNSTATED_LIMITS.items():
                if not _number(limit, key, where) > 0.0:
                    limit.set(key, value)
        if name not in chain:
            continue
        if kind not in ANGULAR_JOINTS:
            raise ValueError(f"{where} is {kind}; the joints of an arm must be revolute")
        mimicked = joint.find("mimic")
        if mimicked is not None:
            raise ValueError(
                f"{where} mimics {mimicked.get('joint')!r}; each joint between the base and "
                f"{flange!r} must be driven by itself"
            )
        distance = float(np.linalg.norm(chain[name].T_parent_joint.position))
        if distance > MAX_JOINT_DISTANCE:
            raise ValueError(
                f"{where} is {distance:.4g} m from its link; origins are in metres, not millimetres"
            )
        if limit is None:
            raise ValueError(f"{where} has no limits lower and upper")
        low, high = (_number(limit, key, where) for key in ("lower", "upper"))
        if not low < high:
            raise ValueError(
                f"{where} turns from lower = {low:g} to upper = {high:g} rad; lower must be the "
                "smaller one"
            )
        if max(-low, high) > MAX_JOINT_ANGLE:
            raise ValueError(
                f"{where} turns from {low:g} to {high:g} rad; limits are in radians (180 degrees "
                'are 3.1416), and a joint without any is type="continuous"'
            )
    return ElementTree.tostring(robot, encoding="unicode")


def _number(limit: ElementTree.Element, key: str, where: str) -> float:
    """Number of a joint's limits, zero where it is not stated."""
    text = limit.get(key, "0")
    try:
        return float(text)
    except ValueError as error:
        raise ValueError(f"{where}: {key} = {text!r} is no number") from error


def _to_se3(pose: Pose) -> pinocchio.SE3:
    w, x, y, z = np.asarray(pose.orientation, float).tolist()
    return pinocchio.SE3(pinocchio.Quaternion(w, x, y, z), np.asarray(pose.position, float))


def _from_se3(placement: pinocchio.SE3) -> Pose:
    return Pose(np.array(placement.translation), poses.from_matrix(np.array(placement.rotation)))
