"""Residuals of a path where arms break their constraints, and how they change with the path.

At each step of the path the joints are solved from those of the step before. The motion of links
and joints with the grip is linearized: the change of the joints is the least one that moves the
grip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.near_pairs import near_pairs
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.planning.path_optimization.block_path import BlockDisplacements, BlockPath
from lariat.planning.path_optimization.grip_residuals import MILLIMETRES, Residuals
from lariat.planning.problem import Problem
from lariat.rod.so3 import left_jacobian
from lariat.safety.constraints.singularity import MIN_SINGULAR_VALUE

if TYPE_CHECKING:
    # Only a cell with arms needs Pinocchio.
    from lariat.arms.kinematics import Joints, UrdfKinematics


LINK_MARGIN = 0.009
"""Distance that links keep beyond their limit [m]."""
JOINT_MARGIN = 0.06
"""Angle that joints keep from the ends of their ranges [rad]."""
SINGULARITY_MARGIN = 0.02
"""Margin of the least singular value above its limit [m/rad]."""
RADIAN_UNIT = 300.0
"""Millimetres that a missing radian counts as: about the motion of a grip [mm/rad]."""
SINGULAR_UNIT = 1000.0
"""Millimetres that a missing unit of the singular value counts as [mm rad/m]."""
JOINT_DIFFERENCE = 1e-4
"""Change of a joint for the derivative of the least singular value [rad]."""
PAIRS_PER_STEP = 6
"""Most pairs of spheres of both arms that count at a step: the nearest ones."""


class _Step:
    """One arm at one step of a path; derivatives are computed where they are asked for."""

    def __init__(self, kinematics: UrdfKinematics, joints: Joints) -> None:
        self.kinematics, self.joints = kinematics, joints
        centres, self.link_radii = kinematics.link_spheres(joints[None])
        self.link_centres: Float64[np.ndarray, "k 3"] = centres[0]

    @cached_property
    def joints_per_twist(self) -> Float64[np.ndarray, "j 6"]:
        """Least change of the joints with a twist of the grip."""
        return np.linalg.pinv(self.kinematics.grip_jacobian(self.joints), rcond=1e-3)

    @cached_property
    def links_per_twist(self) -> Float64[np.ndarray, "k 3 6"]:
        """Motion of the links' spheres with a twist of the grip."""
        return self.kinematics.link_sphere_jacobians(self.joints) @ self.joints_per_twist


class ArmResiduals:
    """Residuals of the arms of one problem."""

    def __init__(self, problem: Problem) -> None:
        """Prepare the residuals.

        Raises:
            ValueError: The problem has no arms.
        """
        if problem.arms is None:
            raise ValueError("the problem has no arms whose geometry is known")
        self._problem, self._cell = problem, problem.arms

    def of_path(self, path: BlockPath, displacements: BlockDisplacements) -> list[Residuals]:
        """Return the residuals [mm] and their Jacobians by the displacements."""
        whole = path.grips(displacements)
        positions, orientations = self._problem.grippers(*whole)
        residuals: list[Residuals] = []
        rows: dict[int, list[_Step | None]] = {}
        twists: dict[int, Float64[np.ndarray, "s 6 k 6"]] = {}
        for end, arm in self._cell.arms.items():
            twists[end] = _twists(path, whole[1], displacements, end)
            steps, unreached = self._solved(arm, end, positions[1:, end], orientations[1:, end])
            rows[end] = steps
            residuals += [
                _by_displacements(
                    MILLIMETRES * away, MILLIMETRES * np.eye(3, 6), twists[end][k], end
                )
                for k, away in unreached
            ]
            for step, row in enumerate(steps):
                if row is not None:
                    residuals += [
                        _by_displacements(residual, twist_row, twists[end][step], end)
                        for residual, twist_row in self._of_arm(arm, row)
                    ]
        residuals += self._spacing(rows, twists, positions[1:], orientations[1:])
        return residuals

    def _solved(
        self,
        arm: UrdfKinematics,
        end: int,
        positions: Float64[np.ndarray, "s 3"],
        orientations: Float64[np.ndarray, "s 4"],
    ) -> tuple[list[_Step | None], list[tuple[int, Float64[np.ndarray, "3"]]]]:
        """Arm at each step, and the motions from the last pose in reach to those beyond it."""
        joints = self._cell.joints[end]
        last = arm.grip(joints).position
        steps: list[_Step | None] = []
        unreached = []
        for k, (position, orientation) in enumerate(zip(positions, orientations, strict=True)):
            solved = arm.solve(Pose(position, orientation), joints)
            if solved is None:
                steps.append(None)
                unreached.append((k, position - last))
            else:
                joints, last = solved, position
                steps.append(_Step(arm, joints))
        return steps, unreached

    def _of_arm(
        self, arm: UrdfKinematics, step: _Step
    ) -> list[tuple[Float64[np.ndarray, "r"], Float64[np.ndarray, "r 6"]]]:
        """Residuals of one arm at one step, and their Jacobians by the twist of its grip."""
        problem = self._problem
        residuals = []
        low, high = arm.joint_range
        below, above = low + JOINT_MARGIN - step.joints, step.joints - high + JOINT_MARGIN
        for lack, sign in ((below, -1.0), (above, 1.0)):
            (bad,) = np.nonzero(lack > 0.0)
            if len(bad):
                residuals.append(
                    (RADIAN_UNIT * lack[bad], sign * RADIAN_UNIT * step.joints_per_twist[bad])
                )
        residuals += self._singularity(arm, step)
        keep_out = problem.limits.keep_out + LINK_MARGIN
        solids = [o for o in problem.solid if o.shape != "half_space"]
        floors = [o for o in problem.solid if o.shape == "half_space"]
        for obstacles, distance in ((solids, keep_out), (floors, LINK_MARGIN)):
            residuals += _near(step, obstacles, distance)
        return residuals

    def _singularity(
        self, arm: UrdfKinematics, step: _Step
    ) -> list[tuple[Float64[np.ndarray, "1"], Float64[np.ndarray, "1 6"]]]:
        moved = step.joints + JOINT_DIFFERENCE * np.eye(len(step.joints))
        value, *values = arm.smallest_singular_values(np.vstack([step.joints, moved]))
        lack = MIN_SINGULAR_VALUE + SINGULARITY_MARGIN - value
        if lack <= 0.0:
            return []
        slope = (np.array(values) - value) / JOINT_DIFFERENCE
        return [
            (
                np.array([SINGULAR_UNIT * lack]),
                -SINGULAR_UNIT * slope[None] @ step.joints_per_twist,
            )
        ]

    def _spacing(
        self,
        rows: dict[int, list[_Step | None]],
        twists: dict[int, Float64[np.ndarray, "s 6 k 6"]],
        positions: Float64[np.ndarray, "s 2 3"],
        orientations: Float64[np.ndarray, "s 2 4"],
    ) -> list[Residuals]:
        """Missing distances between the bodies of both ends, the two grippers excepted."""
        spacing = self._problem.limits.keep_out + LINK_MARGIN
        residuals: list[Residuals] = []
        grippers = [
            self._cell.gripper_spheres(end, positions[:, end], orientations[:, end])
            for end in (0, 1)
        ]
        for step in range(len(positions)):
            left, right = (
                self._body(
                    end,
                    rows[end][step] if end in rows else None,
                    grippers[end].centres[step],
                    grippers[end].radii,
                    positions[step, end],
                )
                for end in (0, 1)
            )
            apart = left.centres[:, None] - right.centres[None]
            distance = np.sqrt(np.einsum("ijc,ijc->ij", apart, apart))
            lack = spacing + left.radii[:, None] + right.radii - distance
            lack[: left.grippers, : right.grippers] = 0.0
            near = np.argsort(-lack, axis=None)[:PAIRS_PER_STEP]
            for i, j in zip(*np.unravel_index(near, lack.shape), strict=True):
                if lack[i, j] <= 0.0:
                    break
                normal = apart[i, j] / max(float(distance[i, j]), 1e-9)
                residual = np.array([MILLIMETRES * lack[i, j]])
                jacobian = np.zeros((1, twists[next(iter(twists))].shape[2], 2, 6))
                for end, body, sign, k in ((0, left, -1.0, i), (1, right, 1.0, j)):
                    if end in twists:
                        row = sign * MILLIMETRES * (normal @ body.per_twist(k))[None]
                        jacobian += _by_displacements(residual, row, twists[end][step], end)[1]
                residuals.append((residual, jacobian))
        return residuals

    def _body(
        self,
        end: int,
        arm: _Step | None,
        centres: Float64[np.ndarray, "k 3"],
        radii: Float64[np.ndarray, "k"],
        grip: Float64[np.ndarray, "3"],
    ) -> _Body:
        """Gripper, links and base of an end at one step."""
        if arm is None:
            return _Body(centres, radii, len(radii), grip, None)
        base_centres, base_radii = self._cell.arms[end].base_spheres
        return _Body(
            np.concatenate([centres, arm.link_centres, base_centres]),
            np.concatenate([radii, arm.link_radii, base_radii]),
            len(radii),
            grip,
            arm,
        )


@dataclass(frozen=True)
class _Body:
    """Spheres of one end at one step: gripper, links, base."""

    centres: Float64[np.ndarray, "k 3"]
    radii: Float64[np.ndarray, "k"]
    grippers: int
    """Number of spheres of the gripper."""
    grip: Float64[np.ndarray, "3"]
    arm: _Step | None

    def per_twist(self, k: int) -> Float64[np.ndarray, "3 6"]:
        """Motion of a sphere with a twist of the grip."""
        if k < self.grippers:
            x, y, z = self.centres[k] - self.grip
            turning = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
            return np.hstack([np.eye(3), turning])
        link = k - self.grippers
        if self.arm is not None and link < len(self.arm.link_radii):
            return self.arm.links_per_twist[link]
        return np.zeros((3, 6))


def _near(
    step: _Step, obstacles: Sequence[Obstacle], distance: float
) -> list[tuple[Float64[np.ndarray, "r"], Float64[np.ndarray, "r 6"]]]:
    """Missing distances of the moving links from obstacles."""
    hit = near_pairs(step.link_centres, obstacles, step.link_radii + distance)
    if not len(hit.points):
        return []
    lack = step.link_radii[hit.points] + distance - hit.distances
    along = np.einsum("ac,act->at", hit.normals, step.links_per_twist[hit.points])
    return [(MILLIMETRES * lack, -MILLIMETRES * along)]


def _twists(
    path: BlockPath,
    orientations: Float64[np.ndarray, "s+1 2 4"],
    displacements: BlockDisplacements,
    end: int,
) -> Float64[np.ndarray, "s 6 k 6"]:
    """Change of an end's pose after each step by the displacements of its blocks."""
    blocks = len(displacements)
    share = path.share
    twists = np.zeros((len(share), 6, blocks, 6))
    twists[:, [0, 1, 2], :, [0, 1, 2]] = share[None]
    ends = path.block_ends(orientations)[:, end]
    change = left_jacobian(displacements[:, end, 3:], np.eye(3)[:, None, :])
    for step, part in enumerate(share):
        # A rotation after block k rotates the change of that block with it.
        after = poses.multiply(orientations[step + 1, end], poses.conjugate(ends))
        after[part < 1.0] = poses.IDENTITY
        turned = poses.rotate(after[None], change) * part[None, :, None]
        twists[step, 3:, :, 3:] = np.transpose(turned, (2, 1, 0))
    return twists


def _by_displacements(
    residual: Float64[np.ndarray, "r"],
    by_twist: Float64[np.ndarray, "r 6"],
    twist: Float64[np.ndarray, "6 k 6"],
    end: int,
) -> Residuals:
    """Residuals with their Jacobian by the displacements of both ends."""
    jacobian = np.zeros((len(residual), twist.shape[1], 2, 6))
    jacobian[:, :, end] = np.einsum("rt,tkd->rkd", np.atleast_2d(by_twist), twist)
    return residual, jacobian
