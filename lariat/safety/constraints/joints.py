"""Joint constraints of an arm: range, speed and acceleration, singularity, collision of its links.

The joints track the commanded grip on the arm's branch of the inverse kinematics. Paths of the grip
are solved from there.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.safety.constraints.arm_kinematics import ArmKinematics, Joints
from lariat.safety.constraints.collision import CollisionConstraint
from lariat.safety.constraints.near_solids import NearSolids
from lariat.safety.constraints.rule import Rule
from lariat.safety.constraints.singularity import singularity_slack
from lariat.safety.constraints.slacks import Slacks, first_broken
from lariat.safety.constraints.sphere_distance import Spheres
from lariat.scenario.sections import Limits

LEAST_SOLVED_POSES = 8
"""Least number of poses of a chunk for which joints are solved, if it has as many."""
SAME_POSE_TOLERANCE = 1e-12
"""Difference in position and quaternion up to which two grip poses count as one [m, -]."""
MAX_SOLVED_STRIDE = 0.025
"""Longest motion of a grip between two poses for which joints are solved [m]."""
CHUNK_ACCELERATION_SHARE = 1.5
"""Share of the limit on the acceleration of a joint that a chunk may use [-], as of that of a grip:
it ends with a stop, which brakes as hard as the limits of the grips allow."""
SURE_SHARE = 1.0 - 1e-9
"""Share of that below which rounding plays no part [-]."""

Path = Float64[np.ndarray, "m j"]
"""Joint angles along a path, the present ones first [rad]."""


class JointConstraints:
    """Constraints on the joints of one arm, which track the commanded grip."""

    def __init__(
        self,
        kinematics: ArmKinematics,
        limits: Limits,
        speed_share: float = 1.0,
        acceleration_share: float = CHUNK_ACCELERATION_SHARE,
    ) -> None:
        """Create the constraints of an arm whose joints are not known yet.

        Args:
            kinematics: Geometry of the arm.
            limits: Limits of the cell. A lower speed of the arm's slowest joint counts instead.
            speed_share: Share of the limit on the speed of a joint that may be used [-].
            acceleration_share: The same of the limit on its acceleration [-].
        """
        self.kinematics = kinematics
        speed = min(limits.joint_speed, float(np.min(kinematics.max_joint_speed)))
        self.joint_speed = speed_share * speed
        """Largest speed of every joint [rad/s]."""
        self.joint_acceleration = acceleration_share * limits.joint_acceleration
        """Largest acceleration of every joint along a chunk or a planned path [rad/s^2]."""
        self.joints: Joints | None = None
        """Joints of the commanded grip; None until the arm has reported."""
        self._solved: tuple[Pose, Joints] | None = None
        """Grip pose that was solved last from the present joints, and its joints."""
        self._followed: Path | None = None
        """Path of the joints that was followed last; None where it led out of reach."""
        self._links = Spheres(np.zeros((0, 0, 3)), np.zeros(0))
        """Spheres of the links along the path that was checked last, the present ones first."""
        self._near_solids = NearSolids()

    def set_joints(self, joints: tuple[float, ...]) -> None:
        """Set the joints to those that the arm reports [rad], which also select the branch."""
        self.joints = np.array(joints, dtype=float)
        # They may be on another branch.
        self._solved = None

    def track(self, grip: Pose) -> None:
        """Solve the joints for the commanded grip; a pose out of reach leaves them unchanged."""
        if self.joints is not None:
            solution = self._solve(grip, self.joints)
            self.joints = self.joints if solution is None else solution

    def _solve(self, grip: Pose, near: Joints) -> Joints | None:
        """Return the joints for a grip pose on the branch of `near`, if any.

        The pose that was solved last from the present joints is remembered: in one tick the next
        command is solved for its speed, for its stop, and when it is taken.
        """
        begun = near is self.joints
        if begun and self._solved is not None:
            pose, joints = self._solved
            if _near(pose.position, grip.position) and _near(pose.orientation, grip.orientation):
                return joints
        solution = self.kinematics.solve(grip, near)
        if solution is not None and begun:
            self._solved = grip, solution
        return solution

    def too_fast(self, grip: Pose, velocity: Float64[np.ndarray, "2 3"]) -> bool:
        """Return whether a twist of the grip exceeds the speed limit of a joint.

        A pose out of reach, or joints that are not known, count as too fast.
        """
        joints = None if self.joints is None else self._solve(grip, self.joints)
        if joints is None:
            return True
        speeds = np.abs(self.kinematics.joint_speed(joints, velocity))
        return bool(speeds.max() > self.joint_speed)

    def follow(
        self, positions: Float64[np.ndarray, "m 3"], orientations: Float64[np.ndarray, "m 4"]
    ) -> None:
        """Solve the joints along a path of the grip, which `too_fast` and `broken_on_path` judge.

        Args:
            positions: Poses of the grip for which joints are solved, near the command [m].
            orientations: Its orientations, wxyz.
        """
        self._followed = None
        if self.joints is not None:
            self._followed = self.kinematics.follow(positions, orientations, self.joints)
        if self._followed is not None:
            self._solved = Pose(positions[0], orientations[0]), self._followed[1]

    def broken(
        self,
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
        solved: list[int],
        collision: CollisionConstraint,
        margin: float,
        dt: float | None = None,
    ) -> tuple[Rule, float] | None:
        """Return the first rule that a path of the grip breaks, and by how much [rad, m].

        Args:
            positions: Path of the grip that begins near the command [m].
            orientations: Orientations along it.
            solved: Indices of the poses for which joints are solved.
            collision: Constraint on the distance of the links from obstacles.
            margin: Slack that the links keep from obstacles [m].
            dt: Time between two poses, for speeds and accelerations of the joints [s]; None where
                the poses are not evenly spaced in time.
        """
        self.follow(positions[solved], orientations[solved])
        if self._followed is not None and dt is not None:
            durations = dt * np.diff(solved)[:, None]
            rates = np.diff(self._followed[1:], axis=0) / durations
            accelerations = 2.0 * np.diff(rates, axis=0) / (durations[1:] + durations[:-1])
            excess = float(np.abs(rates).max(initial=0.0)) - self.joint_speed
            if excess > 0.0:
                return "joint_speed", excess
            excess = float(np.abs(accelerations).max(initial=0.0)) - self.joint_acceleration
            if excess > 0.0:
                return "joint_acceleration", excess
        return self.broken_on_path(collision, margin)

    def broken_on_path(
        self, collision: CollisionConstraint, margin: float
    ) -> tuple[Rule, float] | None:
        """Return the first rule that the path that was followed breaks, and by how much [rad, m].

        Args:
            collision: Constraint on the distance of the links from obstacles.
            margin: Slack that the links keep from obstacles [m].
        """
        if self.joints is None:
            return "lost_link", 0.0
        if self._followed is None:
            # The reach ends where the arm is stretched out, which is singular.
            return "singularity", 0.0
        path = self._followed
        self._links = Spheres(*self.kinematics.link_spheres(path))
        slacks: Slacks = {
            "joint_limits": self._range_slack(path),
            "singularity": singularity_slack(self.kinematics, path),
        }
        broken = first_broken(slacks)
        if broken:
            return broken
        links = self._links.centres, self._links.radii, self._near_solids
        return first_broken(collision.slacks(*links), margin)

    def limit_slack(self, measured: Joints) -> Slacks:
        """Return the slack of the joint limits for the commanded and the measured joints [rad]."""
        rows = np.array([self.joints, measured])
        return {"joint_limits": self._range_slack(rows)}

    def _range_slack(self, rows: Float64[np.ndarray, "m j"]) -> Float64[np.ndarray, "m"]:
        """Return the least distance of the joints from the ends of their ranges [rad]."""
        low, high = self.kinematics.joint_range
        return np.minimum.reduce(np.minimum(rows - low, high - rows), axis=1)

    def link_slacks(self, measured: Joints, collision: CollisionConstraint) -> Slacks:
        """Return the slacks of the links for the commanded and the measured joints [m].

        They become the path of `spheres`.
        """
        path = np.array([self.joints, measured])
        self._links = Spheres(*self.kinematics.link_spheres(path))
        return collision.slacks(self._links.centres, self._links.radii, self._near_solids)

    def spheres(self) -> Spheres:
        """Return the spheres that cover the arm along the path that was checked last."""
        links, base = self.bodies()
        return Spheres.joined([links, base.repeated(len(links.centres))])

    def bodies(self) -> tuple[Spheres, Spheres]:
        """Return the spheres of the links along the path that was checked last, and the base's."""
        centres, radii = self.kinematics.base_spheres
        return self._links, Spheres(centres[None], radii)


def _near(a: Float64[np.ndarray, "k"], b: Float64[np.ndarray, "k"]) -> bool:
    """Return whether a few numbers of two poses are the same; NumPy takes twice as long."""
    return all(
        abs(x - y) < SAME_POSE_TOLERANCE for x, y in zip(a.tolist(), b.tolist(), strict=True)
    )


def solved_poses_of_chunk(positions: Float64[np.ndarray, "m ends 3"]) -> list[int]:
    """Return the poses of a chunk for which joints are solved: dense enough, the last included."""
    moves = positions[1:] - positions[:-1]
    steps = np.sqrt(np.add.reduce(moves * moves, axis=-1))
    longest = float(np.add.reduce(steps).max(initial=0.0))
    count = min(
        len(positions), max(LEAST_SOLVED_POSES, 1 + int(np.ceil(longest / MAX_SOLVED_STRIDE)))
    )
    stride, last = max(1, (len(positions) - 1) // max(count - 1, 1)), len(positions) - 1
    if stride * steps.max(initial=0.0) < SURE_SHARE * MAX_SOLVED_STRIDE:
        return [*range(0, last, stride), last]
    # Where the motion is fast the poses are far apart: none of them is left out there.
    solved, rows = [0], steps.tolist()
    travelled = [0.0] * positions.shape[1]
    for k in range(1, len(positions)):
        travelled = [way + step for way, step in zip(travelled, rows[k - 1], strict=True)]
        far = k + 1 < len(positions) and any(
            way + step > MAX_SOLVED_STRIDE for way, step in zip(travelled, rows[k], strict=True)
        )
        if far or k - solved[-1] >= stride or k == last:
            solved.append(k)
            travelled = [0.0] * len(travelled)
    return solved


def solved_poses_of_stop(positions: Float64[np.ndarray, "m ends 3"]) -> list[int]:
    """Return the poses of a stop for which joints are solved: its ends, and some between.

    A stop is planned anew at every tick, so that few of its poses suffice.
    """
    longest = max(map(math.dist, positions[-1].tolist(), positions[0].tolist()))
    count = 2 + int(longest / MAX_SOLVED_STRIDE)
    step = (len(positions) - 1) / (count - 1)
    return sorted({*(round(k * step) for k in range(count - 1)), len(positions) - 1})
