"""Residuals of a path where arms break their constraints, and how they change with the path.

At each step of the path the joints are solved from those of the step before. The motion of links
and joints with the grip is linearized: the change of the joints is the least one that moves the
grip.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grips import Grips
from lariat.geometry.near_pairs import near_pairs
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.planning.path_optimization.block_path import BlockDisplacements, BlockPath
from lariat.planning.path_optimization.grip_residuals import MILLIMETRES, Residuals
from lariat.planning.problem import Problem
from lariat.safety.constraints.singularity import MIN_SINGULAR_VALUE
from lariat.safety.constraints.sphere_distance import Spheres

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


TwistRows = tuple[Float64[np.ndarray, "r"], Float64[np.ndarray, "r 6"]]
"""Residuals, and their Jacobian by the twist of a grip."""


class _End:
    """Gripper of one end at one step of a path."""

    def __init__(self, grip: Pose, cover: Spheres) -> None:
        self.position = grip.position
        self.centres, self.radii = cover.centres[0], cover.radii
        self.grippers = len(self.radii)
        """Number of spheres of the gripper, which come first."""

    def per_twist(self, k: int) -> Float64[np.ndarray, "3 6"]:
        """Motion of a sphere with a twist of the grip."""
        x, y, z = self.centres[k] - self.position
        turning = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        return np.hstack([np.eye(3), turning])


class _EndOfArm(_End):
    """End with the links and the base of its arm; derivatives are computed where asked for."""

    def __init__(
        self, grip: Pose, cover: Spheres, arm: UrdfKinematics, joints: Joints, links: Spheres
    ) -> None:
        super().__init__(grip, cover)
        self.arm, self.joints = arm, joints
        (self.link_centres,), self.link_radii = links.centres, links.radii
        base, base_radii = arm.base_spheres
        self.centres = np.concatenate([self.centres, self.link_centres, base])
        self.radii = np.concatenate([self.radii, self.link_radii, base_radii])

    @cached_property
    def joints_per_twist(self) -> Float64[np.ndarray, "j 6"]:
        """Least change of the joints with a twist of the grip."""
        return np.linalg.pinv(self.arm.grip_jacobian(self.joints), rcond=1e-3)

    @cached_property
    def links_per_twist(self) -> Float64[np.ndarray, "k 3 6"]:
        """Motion of the links' spheres with a twist of the grip."""
        return self.arm.link_sphere_jacobians(self.joints) @ self.joints_per_twist

    def per_twist(self, k: int) -> Float64[np.ndarray, "3 6"]:
        link = k - self.grippers
        if link < 0:
            return super().per_twist(k)
        return self.links_per_twist[link] if link < len(self.link_radii) else np.zeros((3, 6))


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
        grips = self._problem.grippers(whole)[1:]
        twists = {end: path.twists(whole, displacements, end) for end in self._cell.arms}
        residuals: list[Residuals] = []
        bodies: list[list[_End]] = []
        for end in (0, 1):
            bodies.append([])
            for step, (body, rows) in enumerate(self._placed(end, grips)):
                bodies[end].append(body)
                residuals += [
                    _by_displacements(residual, row, twists[end][step], end)
                    for residual, row in rows
                ]
        for step, (left, right) in enumerate(zip(*bodies, strict=True)):
            residuals += self._spacing(left, right, {e: t[step] for e, t in twists.items()})
        return residuals

    def _placed(self, end: int, grips: Grips) -> Iterator[tuple[_End, list[TwistRows]]]:
        """Bodies of an end at each step, with the residuals of its arm if it has one."""
        arm, cell = self._cell.arms.get(end), self._cell
        covers = cell.gripper_spheres(end, grips)
        placed = [
            (grips.pair(k)[end], Spheres(covers.centres[k, None], covers.radii))
            for k in range(len(grips))
        ]
        if arm is None:
            for grip, cover in placed:
                yield _End(grip, cover), []
            return
        path, reached = [cell.joints[end]], []
        for grip, _ in placed:
            solved = arm.solve(grip, path[-1])
            reached.append(solved is not None)
            path.append(path[-1] if solved is None else solved)
        centres, radii = arm.link_spheres(np.array(path))
        values = arm.smallest_singular_values(np.array(path)).tolist()
        last = arm.grip(path[0]).position
        for k, (grip, cover) in enumerate(placed):
            if reached[k]:
                last, links = grip.position, Spheres(centres[k + 1, None], radii)
                body = _EndOfArm(grip, cover, arm, path[k + 1], links)
                yield body, self._of_arm(body, values[k + 1])
            else:
                # Back to the last pose in reach.
                away = MILLIMETRES * (grip.position - last)
                yield _End(grip, cover), [(away, MILLIMETRES * np.eye(3, 6))]

    def _of_arm(self, body: _EndOfArm, singular_value: float) -> list[TwistRows]:
        """Residuals of one arm at one step."""
        problem = self._problem
        residuals = []
        low, high = body.arm.joint_range
        below, above = low + JOINT_MARGIN - body.joints, body.joints - high + JOINT_MARGIN
        for lack, sign in ((below, -1.0), (above, 1.0)):
            (bad,) = np.nonzero(lack > 0.0)
            if len(bad):
                residuals.append(
                    (RADIAN_UNIT * lack[bad], sign * RADIAN_UNIT * body.joints_per_twist[bad])
                )
        if singular_value < MIN_SINGULAR_VALUE + SINGULARITY_MARGIN:
            residuals.append(_singularity(body, singular_value))
        keep_out = problem.limits.keep_out + LINK_MARGIN
        solids = [o for o in problem.solid if o.shape != "half_space"]
        floors = [o for o in problem.solid if o.shape == "half_space"]
        for obstacles, distance in ((solids, keep_out), (floors, LINK_MARGIN)):
            residuals += _near(body, obstacles, distance)
        return residuals

    def _spacing(
        self, left: _End, right: _End, twists: dict[int, Float64[np.ndarray, "6 k 6"]]
    ) -> list[Residuals]:
        """Missing distances between the bodies of both ends at one step, both grippers excepted."""
        spacing = self._problem.limits.keep_out + LINK_MARGIN
        apart = left.centres[:, None] - right.centres[None]
        distance = np.sqrt(np.einsum("ijc,ijc->ij", apart, apart))
        lack = spacing + left.radii[:, None] + right.radii - distance
        lack[: left.grippers, : right.grippers] = 0.0
        near = np.argsort(-lack, axis=None)[:PAIRS_PER_STEP]
        residuals = []
        for i, j in zip(*np.unravel_index(near, lack.shape), strict=True):
            if lack[i, j] <= 0.0:
                break
            normal = apart[i, j] / max(float(distance[i, j]), 1e-9)
            residual = np.array([MILLIMETRES * lack[i, j]])
            bodies = ((0, left, -1.0, i), (1, right, 1.0, j))
            rows = {
                end: sign * MILLIMETRES * (normal @ body.per_twist(k))[None]
                for end, body, sign, k in bodies
            }
            parts = [_by_displacements(residual, rows[e], t, e)[1] for e, t in twists.items()]
            residuals.append((residual, sum(parts)))
        return residuals


def _singularity(body: _EndOfArm, value: float) -> TwistRows:
    """What the least singular value of an arm lacks."""
    lack = MIN_SINGULAR_VALUE + SINGULARITY_MARGIN - value
    moved = body.joints + JOINT_DIFFERENCE * np.eye(len(body.joints))
    slope = (body.arm.smallest_singular_values(moved) - value) / JOINT_DIFFERENCE
    by_twist = -SINGULAR_UNIT * slope[None] @ body.joints_per_twist
    return np.array([SINGULAR_UNIT * lack]), by_twist


def _near(body: _EndOfArm, obstacles: Sequence[Obstacle], distance: float) -> list[TwistRows]:
    """Missing distances of the moving links from obstacles."""
    hit = near_pairs(body.link_centres, obstacles, body.link_radii + distance)
    if not len(hit.points):
        return []
    lack = body.link_radii[hit.points] + distance - hit.distances
    along = np.einsum("ac,act->at", hit.normals, body.links_per_twist[hit.points])
    return [(MILLIMETRES * lack, -MILLIMETRES * along)]


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
