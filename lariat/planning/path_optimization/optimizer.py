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
from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.polylines import with_midpoints
from lariat.planning.arms.arm_residuals import ArmResiduals
from lariat.planning.path_check import MIN_CLEARANCE
from lariat.planning.path_optimization.block_path import (
    BLOCK_TIME,
    BLOCKS,
    STEP_TIME,
    STEPS_PER_BLOCK,
    BlockDisplacements,
    BlockPath,
)
from lariat.planning.path_optimization.grip_residuals import (
    MILLIMETRES,
    Residuals,
    grip_residuals,
)
from lariat.planning.path_optimization.swept_pairs import SweptPairs, swept_pairs
from lariat.planning.problem import Problem
from lariat.rod import RodState, RolloutSpec, count_turns

CLEARANCE_WEIGHT = 0.5
"""Weight of missing clearance."""
SUPPORT_WEIGHT = 0.2
"""Weight of missing clearance to supports, except where start and goal lean on them: the rope
approaches its support from above, instead of being dragged along it against friction."""
END_RELAXATION = 5e-4
"""Clearance by which the path may fall short of that of start and goal [m]."""
END_BLOCKS = 2
"""Number of blocks at both ends in which the clearance of start or goal is sufficient."""
CLEARANCE_GAIN = 0.008
"""Increase of the required clearance with each further block from the ends [m]."""
CLEARANCE_RESERVE = 0.004
"""Clearance beyond the wanted one [m], for deviations in motion from the quasi-static path."""
UNCERTAINTY_DEVIATIONS = 2.0
"""Standard deviations of a node's position that are added to its clearance [-]."""
MAX_UNCERTAINTY = 0.02
"""Largest clearance that is added for them [m]."""
INITIAL_DAMPING = 1e-3
"""Levenberg-Marquardt damping of the first iteration."""
DAMPING_RANGE = (1e-7, 1e6)
"""Range of the damping."""
DAMPING_INCREASE = 10.0
"""Factor on the damping after a step that does not lower the cost."""
DAMPING_DECREASE = 0.2
"""Factor on the damping after a step that lowers the cost."""
MAX_DAMPING_INCREASES = 8
"""Number of steps in a row that may fail before the path counts as optimal."""
RELATIVE_TOLERANCE = 1e-3
"""Relative gain of an iteration below which the optimisation has converged."""
ABSOLUTE_TOLERANCE = 1e-4
"""Absolute gain that is added to the relative one [mm^2]."""


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
    residuals: Float64[np.ndarray, "r"] = field(repr=False)
    """Weighted residuals [mm]."""
    grip_residuals: list[Residuals] = field(repr=False)
    """Those of the grips and arms, with their Jacobians."""
    rope_near: SweptPairs = field(repr=False)
    """Points of the rope with too little clearance to obstacles."""
    support_near: SweptPairs = field(repr=False)
    """Points of the rope with too little clearance to supports."""
    gripper_near: SweptPairs = field(repr=False)
    """Points of the grippers with too little clearance."""


class PathOptimizer:
    """Evaluates and refines paths of one problem."""

    def __init__(
        self,
        problem: Problem,
        reserve: float = CLEARANCE_RESERVE,
        blocks: int = BLOCKS,
        avoid_with_arms: bool = False,
    ) -> None:
        """Prepare the optimisation of the problem's paths.

        Args:
            reserve: Clearance beyond the wanted one [m].
            blocks: Number of blocks of a path.
            avoid_with_arms: Whether the constraints of the problem's arms count too, which takes
                several times as long.
        """
        self._arms = ArmResiduals(problem) if avoid_with_arms else None
        self.problem = problem
        self.reserve, self.blocks = reserve, blocks
        self.led_arms: list[PathCandidate] = []
        """Candidates that arms could not go, and that have been optimized for them."""
        self._path = BlockPath(problem, blocks)
        self._uncertainty = np.zeros((blocks * STEPS_PER_BLOCK, 2 * problem.rod.node_count - 1))
        """Clearance that is added for nodes and edge midpoints at each step [m]."""
        self._set_margins()
        self._supports = problem.packed_supports
        self._rotation = self._path.rotation_to_goal(0)
        if problem.moves[:, 3:].any():
            # The rotations of the ends determine the twist of the rope: add the missing turns.
            direct = self.translated(self._path.translation_to_goal())
            turns = problem.goal.turns - count_turns(direct.final)
            missing = 0 if problem.goal.ends_only else turns
            self._rotation = self._path.rotation_to_goal(missing) if missing else self._rotation

    @property
    def wanted_clearance(self) -> float:
        """Clearance to keep along the path: the problem's, or that of start or goal if less [m]."""
        return min(self.problem.clearance, float(np.min(self._margins)))

    @property
    def necessary_clearance(self) -> float:
        """Wanted clearance without what the problem can spare [m]."""
        return min(self.wanted_clearance, self.problem.clearance - self.problem.spare_clearance)

    @property
    def required_clearance(self) -> float:
        """Clearance below which a path is blocked [m]."""
        return min(MIN_CLEARANCE, self.necessary_clearance)

    @property
    def goal_clearance(self) -> float:
        """Clearance of the goal itself [m]."""
        problem = self.problem
        return geometry.chain_clearance(problem.goal.nodes, problem.radius, problem.obstacles)

    def allow_for_uncertainty(self, candidate: PathCandidate) -> PathCandidate:
        """Add clearance where the rope is unsure along a path; return it with its new cost.

        The problem's variants are rolled out along the path: their distances from the rope give the
        standard deviation of each node.
        """
        problem = self.problem
        variance = np.zeros(candidate.nodes.shape[:2])
        for rod in problem.variants:
            start = rod.rest(*problem.grips, guess=problem.state, obstacles=self._supports).state
            rollout = rod.rollout(self._rollout_spec(candidate.displacements, start))
            variance += np.sum((rollout.positions - candidate.nodes) ** 2, axis=2)
        deviation = np.sqrt(variance)[: len(self._uncertainty)]
        between = 0.5 * (deviation[:, 1:] + deviation[:, :-1])
        self._uncertainty = np.minimum(
            UNCERTAINTY_DEVIATIONS * np.concatenate([deviation, between], axis=1),
            MAX_UNCERTAINTY,
        )
        self._set_margins()
        return self.reevaluate(candidate)

    def follow(self, displacements: BlockDisplacements) -> PathCandidate:
        """Return the candidate of given displacements."""
        spec = self._rollout_spec(displacements, self.problem.state)
        rollout = self.problem.rod.rollout(spec)
        return self._candidate(displacements, rollout.positions, rollout.final)

    def translated(self, translations: Float64[np.ndarray, "k 2 3"]) -> PathCandidate:
        """Return the candidate of translations [m] that rotates evenly to the goal."""
        return self.follow(np.concatenate([translations, self._rotation], axis=2))

    def reevaluate(self, candidate: PathCandidate) -> PathCandidate:
        """Return a candidate of another optimiser with the cost of this one."""
        return self._candidate(candidate.displacements, candidate.nodes, candidate.final)

    def refine(self, candidate: PathCandidate, iterations: int) -> PathCandidate:
        """Return the candidate after at most `iterations` Gauss-Newton iterations."""
        least_damping, most_damping = DAMPING_RANGE
        damping = INITIAL_DAMPING
        for _ in range(iterations):
            hessian, gradient = self._normal_equations(candidate)
            scale = np.diag(np.diag(hessian)) + 1e-6 * np.eye(len(hessian))
            for _ in range(MAX_DAMPING_INCREASES):
                step = -np.linalg.solve(hessian + damping * scale, gradient)
                change = np.zeros_like(candidate.displacements)
                change[:, self.problem.moves] = step.reshape(self.blocks, -1)
                better = self.follow(candidate.displacements + change)
                if better.cost < candidate.cost:
                    break
                damping = min(DAMPING_INCREASE * damping, most_damping)
            else:
                return candidate
            gain = candidate.cost - better.cost
            candidate, damping = better, max(DAMPING_DECREASE * damping, least_damping)
            if gain < RELATIVE_TOLERANCE * candidate.cost + ABSOLUTE_TOLERANCE:
                break
        return candidate

    def grips(self, candidate: PathCandidate) -> Grips:
        """Return both grips at the start and after each step."""
        return self._path.grips(candidate.displacements)

    def _rollout_spec(
        self, displacements: BlockDisplacements, start: RodState
    ) -> RolloutSpec[RodState]:
        """Roll-out of a rod along a path."""
        return RolloutSpec(
            start,
            self._path.actions(displacements),
            STEP_TIME,
            block_of_step=self._path.block_of_step,
            obstacles=self._supports,
        )

    def _candidate(
        self,
        displacements: BlockDisplacements,
        nodes: Float64[np.ndarray, "h n 3"],
        final: RodState,
    ) -> PathCandidate:
        problem = self.problem
        miss = (nodes[-1] - problem.goal.nodes)[problem.goal.counted]
        start = problem.state.positions[None]
        points = with_midpoints(np.concatenate([start, nodes[: len(self._margins)]]))
        rope = swept_pairs(points, problem.obstacles, problem.radius, self._margins)
        support = swept_pairs(points, problem.supports, problem.radius, self._support_margins, 0)
        points = problem.gripper_points(self._path.grips(displacements))
        keep = max(problem.clearance, problem.limits.keep_out) + self.reserve
        margins = np.full((len(points) - 1, points.shape[1]), keep)
        gripper = swept_pairs(points, problem.solid, problem.limits.gripper_radius, margins, 0)
        of_grips = grip_residuals(problem, self._path, displacements, self.reserve)
        if self._arms is not None:
            of_grips += self._arms.of_path(self._path, displacements)
        residuals = np.concatenate(
            [
                MILLIMETRES / np.sqrt(len(miss)) * miss.ravel(),
                MILLIMETRES * CLEARANCE_WEIGHT * rope.lacks,
                MILLIMETRES * SUPPORT_WEIGHT * support.lacks,
                MILLIMETRES * CLEARANCE_WEIGHT * gripper.lacks,
                *(residual for residual, _ in of_grips),
            ]
        )
        rope_lack = rope.lacks - self._uncertainty[rope.steps, rope.points]
        lack = max(np.max(rope_lack, initial=0.0), np.max(gripper.lacks, initial=0.0))
        return PathCandidate(
            displacements,
            float(residuals @ residuals),
            nodes,
            final,
            problem.goal_error(nodes[-1]),
            float(lack) - self.reserve,
            residuals,
            of_grips,
            rope,
            support,
            gripper,
        )

    def _normal_equations(
        self, candidate: PathCandidate
    ) -> tuple[Float64[np.ndarray, "v v"], Float64[np.ndarray, "v"]]:
        """Gauss-Newton Hessian and gradient of half the cost."""
        problem, path = self.problem, self._path
        moves = problem.moves
        linear = problem.rod.linearize(self._rollout_spec(candidate.displacements, problem.state))
        # Derivatives of all nodes after each step by the displacements.
        sensitivity = linear.d_positions_d_actions[:, :, :, : self.blocks] / BLOCK_TIME
        count = problem.rod.node_count
        counted = problem.goal.counted
        scale = MILLIMETRES / np.sqrt(np.sum(counted))
        rows = [scale * sensitivity[-1][counted][..., moves].reshape(3 * np.sum(counted), -1)]
        for hit, weight in (
            (candidate.rope_near, MILLIMETRES * CLEARANCE_WEIGHT),
            (candidate.support_near, MILLIMETRES * SUPPORT_WEIGHT),
        ):
            first = np.where(hit.points < count, hit.points, hit.points - count)
            second = np.where(hit.points < count, hit.points, hit.points - count + 1)
            here = 0.5 * (sensitivity[hit.steps, first] + sensitivity[hit.steps, second])
            last = np.maximum(hit.steps - 1, 0)
            before = 0.5 * (sensitivity[last, first] + sensitivity[last, second])
            # The start does not move.
            before[hit.steps == 0] = 0.0
            share = hit.shares[:, None, None, None, None]
            moved = share * here + (1.0 - share) * before
            along = np.einsum("ac,ackem->akem", hit.normals, moved)
            rows.append(-weight * along[..., moves].reshape(-1, rows[0].shape[1]))
        hit = candidate.gripper_near
        along = np.zeros((len(hit.steps), self.blocks, 2, 6))
        share = path.share[hit.steps][:, :, None]
        along[np.arange(len(along)), :, hit.points // 3, :3] = share * hit.normals[:, None, :]
        weight = MILLIMETRES * CLEARANCE_WEIGHT
        rows.append(-weight * along[..., moves].reshape(-1, rows[0].shape[1]))
        for residual, row in candidate.grip_residuals:
            rows.append(row[..., moves].reshape(len(residual), -1))
        jacobian = np.concatenate(rows)
        return jacobian.T @ jacobian, jacobian.T @ candidate.residuals

    def _set_margins(self) -> None:
        """Compute the clearances to keep from obstacles and supports."""
        self._margins = self._clearance_margins(self.problem.obstacles)
        self._support_margins = self._clearance_margins(self.problem.supports)

    def _clearance_margins(self, obstacles: Sequence[Obstacle]) -> Float64[np.ndarray, "s m"]:
        """Clearance of each point at each step; start and goal may be nearer to obstacles [m]."""
        problem = self.problem
        steps = np.arange(self.blocks * STEPS_PER_BLOCK)
        margins = problem.clearance + self.reserve + self._uncertainty
        for nodes, away in ((problem.state.positions, steps), (problem.goal.nodes, steps[::-1])):
            own = geometry.chain_clearance(nodes, problem.radius, obstacles)
            beyond = np.maximum(away / STEPS_PER_BLOCK - END_BLOCKS, 0.0)
            permitted = own - END_RELAXATION + CLEARANCE_GAIN * beyond
            margins = np.minimum(margins, permitted[:, None])
        return margins
