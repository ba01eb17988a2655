"""Path optimisation: change a path until the rope reaches the goal and keeps its clearance.

Gauss-Newton with Levenberg-Marquardt damping on the displacements of both grips in each block. The
rope follows quasi-statically: the implicit steps are so long that it is at rest along the path,
which has no timing yet. Residuals are in millimetres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from lariat.geometry import obstacles as geometry
from lariat.geometry.grippers import swept_gripper_points
from lariat.geometry.near_pairs import NearPairs, near_pairs
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.polylines import with_midpoints
from lariat.planning.arms.arm_residuals import ArmResiduals
from lariat.planning.path_optimization.block_path import BlockDisplacements, BlockPath
from lariat.planning.path_optimization.grip_residuals import MILLIMETRES, grip_residuals
from lariat.planning.path_optimization.settings import PathOptimizationSettings
from lariat.planning.path_optimization.swept_pairs import SweptPairs, swept_pairs
from lariat.planning.problem import Problem
from lariat.rod import RodState, RolloutSpec, count_turns

SETTINGS = PathOptimizationSettings()
"""Default settings."""


@dataclass(frozen=True)
class PathCandidate:
    """Path with the rope along it, and its cost."""

    displacements: BlockDisplacements
    """Translation [m] and rotation [rad] of both grips in each block."""
    cost: float
    """Sum of squared residuals [mm^2]."""
    nodes: Float64[np.ndarray, "h n 3"]
    """Nodes after each step [m]."""
    final: RodState
    """State of the rod at the end."""
    error: float
    """Mean node distance to the goal at the end [m]."""
    shortfall: float
    """Largest lack of the wanted clearance, reserve excluded [m]."""
    rope_near: NearPairs = field(repr=False)
    """Points of the rope with too little clearance to obstacles."""
    rope_swept: SweptPairs = field(repr=False)
    """Points of the rope with too little clearance to obstacles between the steps."""
    support_near: NearPairs = field(repr=False)
    """Points of the rope with too little clearance to supports."""
    gripper_near: NearPairs = field(repr=False)
    """Points of the grippers with too little clearance."""


class PathOptimizer:
    """Evaluates and refines paths of one problem."""

    def __init__(
        self,
        problem: Problem,
        reserve: float | None = None,
        settings: PathOptimizationSettings = SETTINGS,
        avoid_with_arms: bool = False,
    ) -> None:
        """Prepare the optimisation of the problem's paths.

        Args:
            problem: Planning problem.
            reserve: Clearance beyond the wanted one [m]; None: that of the settings.
            settings: Discretisation, weights and margins.
            avoid_with_arms: Whether the constraints of the problem's arms count too, which takes
                several times as long.
        """
        self.settings = s = settings
        self._arms = ArmResiduals(problem) if avoid_with_arms else None
        self._problem = problem
        self.reserve = s.clearance_reserve if reserve is None else reserve
        self._path = BlockPath(problem, s)
        self._uncertainty = np.zeros((s.blocks * s.steps_per_block, 2 * problem.rod.node_count - 1))
        """Clearance that is added for nodes and edge midpoints at each step [m]."""
        self._set_margins()
        self._supports = problem.packed_supports
        self._rotation = self._path.rotation_to_goal(0)
        if problem.moves[:, 3:].any():
            # The rotations of the ends determine the twist of the rope: add the missing turns.
            (direct,) = self.evaluate([self._path.translation_to_goal()])
            missing = (
                0 if problem.goal.ends_only else problem.goal.turns - count_turns(direct.final)
            )
            self._rotation = self._path.rotation_to_goal(missing) if missing else self._rotation

    @property
    def wanted_clearance(self) -> float:
        """Clearance to keep along the path: the problem's, or that of start or goal if less [m]."""
        return min(self._problem.clearance, float(np.min(self._margins)))

    @property
    def necessary_clearance(self) -> float:
        """Wanted clearance without what the problem can spare [m]."""
        return min(self.wanted_clearance, self._problem.clearance - self._problem.spare_clearance)

    @property
    def goal_clearance(self) -> float:
        """Clearance of the goal itself [m]."""
        problem = self._problem
        return geometry.chain_clearance(problem.goal.nodes, problem.radius, problem.obstacles)

    def allow_for_uncertainty(self, candidate: PathCandidate) -> PathCandidate:
        """Add clearance where the rope is unsure along a path; return it with its new cost.

        The problem's variants are rolled out along the path: their distances from the rope give the
        standard deviation of each node.
        """
        problem, s = self._problem, self.settings
        variance = np.zeros(candidate.nodes.shape[:2])
        for rod in problem.variants:
            start = rod.rest(*problem.grips, guess=problem.state, obstacles=self._supports).state
            (rollout,) = rod.rollout(self._rollout_spec([candidate.displacements], start))
            variance += np.sum((rollout.positions - candidate.nodes) ** 2, axis=2)
        deviation = np.sqrt(variance)[: len(self._uncertainty)]
        between = 0.5 * (deviation[:, 1:] + deviation[:, :-1])
        self._uncertainty = np.minimum(
            s.uncertainty_deviations * np.concatenate([deviation, between], axis=1),
            s.max_uncertainty,
        )
        self._set_margins()
        return self.reevaluate(candidate)

    def follow(self, displacements: BlockDisplacements) -> PathCandidate:
        """Return the candidate of given displacements."""
        (candidate,) = self._rolled_out([displacements])
        return candidate

    def evaluate(self, translations: Sequence[Float64[np.ndarray, "k 2 3"]]) -> list[PathCandidate]:
        """Return candidates of translations [m], rotated evenly to the goal, from one launch."""
        return self._rolled_out([np.concatenate([t, self._rotation], axis=2) for t in translations])

    def reevaluate(self, candidate: PathCandidate) -> PathCandidate:
        """Return a candidate of another optimiser with the cost of this one."""
        return self._candidate(candidate.displacements, candidate.nodes, candidate.final)

    def refine(self, candidate: PathCandidate, iterations: int) -> PathCandidate:
        """Return the candidate after at most `iterations` Gauss-Newton iterations."""
        s = self.settings
        least_damping, most_damping = s.damping_range
        damping = s.initial_damping
        for _ in range(iterations):
            hessian, gradient = self._normal_equations(candidate)
            scale = np.diag(np.diag(hessian)) + 1e-6 * np.eye(len(hessian))
            for _ in range(s.max_damping_increases):
                step = -np.linalg.solve(hessian + damping * scale, gradient)
                change = np.zeros_like(candidate.displacements)
                change[:, self._problem.moves] = step.reshape(s.blocks, -1)
                (better,) = self._rolled_out([candidate.displacements + change])
                if better.cost < candidate.cost:
                    break
                damping = min(s.damping_increase * damping, most_damping)
            else:
                return candidate
            gain = candidate.cost - better.cost
            candidate, damping = better, max(s.damping_decrease * damping, least_damping)
            if gain < s.relative_tolerance * candidate.cost + s.absolute_tolerance:
                break
        return candidate

    def grips(
        self, candidate: PathCandidate
    ) -> tuple[Float64[np.ndarray, "s 2 3"], Float64[np.ndarray, "s 2 4"]]:
        """Return positions [m] and orientations of both grips, at the start and after each step."""
        return self._path.grips(candidate.displacements)

    def _rolled_out(self, paths: Sequence[BlockDisplacements]) -> list[PathCandidate]:
        rollouts = self._problem.rod.rollout(self._rollout_spec(paths, self._problem.state))
        return [
            self._candidate(path, r.positions, r.final)
            for path, r in zip(paths, rollouts, strict=True)
        ]

    def _rollout_spec(
        self, paths: Sequence[BlockDisplacements], start: RodState
    ) -> RolloutSpec[Sequence[RodState]]:
        """Roll-out of a rod along several paths."""
        return RolloutSpec(
            [start] * len(paths),
            np.stack([self._path.actions(path) for path in paths]),
            self.settings.step_time,
            block_of_step=self._path.block_of_step,
            obstacles=self._supports,
        )

    def _candidate(
        self,
        displacements: BlockDisplacements,
        nodes: Float64[np.ndarray, "h n 3"],
        final: RodState,
    ) -> PathCandidate:
        problem, s = self._problem, self.settings
        miss = (nodes[-1] - problem.goal.nodes)[problem.goal.counted]
        cost = MILLIMETRES**2 * float(np.mean(np.sum(miss**2, axis=1)))
        points = self._rope_points(nodes)
        obstacle_distances = _distances(points, problem.obstacles)
        rope, rope_lack = self._near(points, problem.obstacles, self._margins, obstacle_distances)
        swept = swept_pairs(
            points,
            obstacle_distances,
            problem.obstacles,
            problem.radius,
            self._margins + problem.radius,
        )
        support_distances = _distances(points, problem.supports)
        support, support_lack = self._near(
            points, problem.supports, self._support_margins, support_distances
        )
        cost += (MILLIMETRES * s.support_weight) ** 2 * float(support_lack @ support_lack)
        points = self._gripper_points(displacements)
        gripper_distance = self._gripper_distance()
        gripper = near_pairs(points, problem.solid, np.full(len(points), gripper_distance))
        gripper_lack = gripper_distance - gripper.distances
        cost += (MILLIMETRES * s.clearance_weight) ** 2 * float(
            rope_lack @ rope_lack + swept.lacks @ swept.lacks + gripper_lack @ gripper_lack
        )
        for residual, _ in self._grip_residuals(displacements):
            cost += float(residual @ residual)
        added = self._uncertainty.ravel()[rope.points]
        added_between = self._uncertainty[swept.steps, swept.points]
        lack = max(
            float(np.max(rope_lack - added, initial=0.0)),
            float(np.max(swept.lacks - added_between, initial=0.0)),
            float(np.max(gripper_lack, initial=0.0)),
        )
        return PathCandidate(
            displacements,
            cost,
            nodes,
            final,
            problem.goal_error(nodes[-1]),
            lack - self.reserve,
            rope,
            swept,
            support,
            gripper,
        )

    def _gripper_distance(self) -> float:
        """Distance that the grippers' axes keep from obstacles [m]."""
        problem = self._problem
        clearance = max(problem.clearance, problem.limits.keep_out) + self.reserve
        return clearance + problem.limits.gripper_radius

    def _rope_points(self, nodes: Float64[np.ndarray, "h n 3"]) -> Float64[np.ndarray, "t m 3"]:
        """Nodes and edge midpoints at the start, and after each step that moves [m]."""
        start = self._problem.state.positions[None]
        return with_midpoints(np.concatenate([start, nodes[: len(self._margins)]]))

    def _near(
        self,
        points: Float64[np.ndarray, "t m 3"],
        obstacles: Sequence[Obstacle],
        margins: Float64[np.ndarray, "s m"],
        distances: Float64[np.ndarray, "o t m"],
    ) -> tuple[NearPairs, Float64[np.ndarray, "a"]]:
        """Points of the rope nearer to obstacles than their margin, and by how much."""
        reach = margins.ravel() + self._problem.radius
        computed = distances[:, 1:].reshape(len(obstacles), reach.size)
        pairs = near_pairs(points[1:].reshape(-1, 3), obstacles, reach, computed)
        return pairs, reach[pairs.points] - pairs.distances

    def _gripper_points(self, displacements: BlockDisplacements) -> Float64[np.ndarray, "p 3"]:
        positions, orientations = self._path.grips(displacements)
        grippers = self._problem.grippers(positions[1:], orientations[1:])
        return swept_gripper_points(*grippers, self._problem.limits.gripper_reach)

    def _grip_residuals(
        self, displacements: BlockDisplacements
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        residuals = grip_residuals(
            self._problem, self.settings, self._path, displacements, self.reserve
        )
        return (
            residuals
            if self._arms is None
            else residuals + self._arms.of_path(self._path, displacements)
        )

    def _normal_equations(
        self, candidate: PathCandidate
    ) -> tuple[Float64[np.ndarray, "v v"], Float64[np.ndarray, "v"]]:
        """Gauss-Newton Hessian and gradient of half the cost."""
        problem, s, path = self._problem, self.settings, self._path
        moves = problem.moves
        linear = problem.rod.linearize(
            RolloutSpec(
                problem.state,
                path.actions(candidate.displacements),
                s.step_time,
                block_of_step=path.block_of_step,
                obstacles=self._supports,
            )
        )
        # Derivatives of all nodes after each step by the displacements.
        sensitivity = linear.d_positions_d_actions[:, :, :, : s.blocks] / path.block_time
        rows, residuals = [], []
        count = problem.rod.node_count
        counted = problem.goal.counted
        scale = MILLIMETRES / np.sqrt(np.sum(counted))
        rows.append(scale * sensitivity[-1][counted][..., moves].reshape(3 * np.sum(counted), -1))
        residuals.append(scale * (candidate.nodes[-1] - problem.goal.nodes)[counted].ravel())
        for hit, margins, weight in (
            (candidate.rope_near, self._margins, s.clearance_weight),
            (candidate.support_near, self._support_margins, s.support_weight),
        ):
            if not len(hit.points):
                continue
            step, at = np.divmod(hit.points, 2 * count - 1)
            first = np.where(at < count, at, at - count)
            second = np.where(at < count, at, at - count + 1)
            here = 0.5 * (sensitivity[step, first] + sensitivity[step, second])
            along = np.einsum("ac,ackem->akem", hit.normals, here)
            rows.append(-MILLIMETRES * weight * along[..., moves].reshape(len(step), -1))
            lack = margins.ravel()[hit.points] + problem.radius - hit.distances
            residuals.append(MILLIMETRES * weight * lack)
        swept = candidate.rope_swept
        if len(swept.points):
            first = np.where(swept.points < count, swept.points, swept.points - count)
            second = np.where(swept.points < count, swept.points, swept.points - count + 1)
            here = 0.5 * (sensitivity[swept.steps, first] + sensitivity[swept.steps, second])
            last = np.maximum(swept.steps - 1, 0)
            before = 0.5 * (sensitivity[last, first] + sensitivity[last, second])
            # The start does not move.
            before[swept.steps == 0] = 0.0
            share = swept.shares[:, None, None, None, None]
            along = np.einsum(
                "ac,ackem->akem", swept.normals, share * here + (1.0 - share) * before
            )
            weight = MILLIMETRES * s.clearance_weight
            rows.append(-weight * along[..., moves].reshape(len(swept.points), -1))
            residuals.append(weight * swept.lacks)
        hit = candidate.gripper_near
        if len(hit.points):
            step, at = np.divmod(hit.points, 6)
            end = at // 3
            along = np.zeros((len(step), s.blocks, 2, 6))
            along[np.arange(len(step)), :, end, :3] = (
                path.share[step][:, :, None] * hit.normals[:, None, :]
            )
            weight = s.clearance_weight
            rows.append(-MILLIMETRES * weight * along[..., moves].reshape(len(step), -1))
            lack = self._gripper_distance() - hit.distances
            residuals.append(MILLIMETRES * weight * lack)
        for residual, row in self._grip_residuals(candidate.displacements):
            rows.append(row[..., moves].reshape(len(residual), -1))
            residuals.append(residual)
        jacobian, residual = np.concatenate(rows), np.concatenate(residuals)
        return jacobian.T @ jacobian, jacobian.T @ residual

    def _set_margins(self) -> None:
        """Compute the clearances to keep from obstacles and supports."""
        self._margins = self._clearance_margins(self._problem.obstacles)
        self._support_margins = self._clearance_margins(self._problem.supports)

    def _clearance_margins(self, obstacles: Sequence[Obstacle]) -> Float64[np.ndarray, "s m"]:
        """Clearance of each point at each step; start and goal may be nearer to obstacles [m]."""
        problem, s = self._problem, self.settings
        steps = np.arange(s.blocks * s.steps_per_block)
        margins = problem.clearance + self.reserve + self._uncertainty
        for nodes, away in ((problem.state.positions, steps), (problem.goal.nodes, steps[::-1])):
            own = geometry.chain_clearance(nodes, problem.radius, obstacles)
            beyond = np.maximum(away / s.steps_per_block - s.end_blocks, 0.0)
            permitted = own - s.end_relaxation + s.clearance_gain * beyond
            margins = np.minimum(margins, permitted[:, None])
        return margins


def _distances(
    points: Float64[np.ndarray, "t m 3"], obstacles: Sequence[Obstacle]
) -> Float64[np.ndarray, "o t m"]:
    """Signed distances of points from each obstacle [m]."""
    signed = np.zeros((len(obstacles), *points.shape[:-1]))
    for k, obstacle in enumerate(obstacles):
        signed[k] = geometry.signed_distance(points, obstacle)
    return signed
