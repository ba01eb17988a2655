"""Bends a way of the grips until the rope reaches the goal and keeps its distance on the way.

Gauss-Newton with Levenberg damping on the displacements of both grips in each block. The rope
follows quasi-statically: implicit steps long enough that it rests along the way, so that the way
has no speed yet. Lengths enter in millimetres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from lariat.geometry import obstacles as geometry
from lariat.geometry import poses
from lariat.geometry.clearance import NearPairs, near_pairs, with_midpoints
from lariat.geometry.grippers import axis_spacing, gripper_axis_distance, swept_gripper_points
from lariat.geometry.obstacles import Obstacle
from lariat.rod import EDGE_AXIS, RodState, RolloutSpec, count_turns
from services.planner.problem import Problem
from shared.motion_contract import (
    PATH_SPACING_MARGIN,
    PATH_STRETCH_SHARE,
    PATH_WORKSPACE_MARGIN,
)

BLOCKS = 12
STEPS = 3
"""Of the rod in a block."""
SETTLE = 2
"""Steps at the end without motion."""
STEP_TIME = 0.4
"""Long against the rope's swinging [s]."""
MILLIMETRE = 1e3
SMOOTHNESS = 0.02
EFFORT = 0.01
NEARNESS = 0.5
LIFTING = 0.2
"""Weight of staying off what the rope may lean on, except where start and goal lean: laid down
from above a rope is not dragged along its support, where friction would hold it."""
CROWDING = 3.0
"""Weight of a millimetre that the ends are too near to each other, or too far apart."""
LEAVING = 5e-4
"""Below its own clearance a start or goal may be passed by so much [m]."""
NEAR_BLOCKS = 2
"""Blocks at the start and at the end in which the clearance of start or goal is enough."""
PARTING = 0.008
"""Clearance gained with each block beyond those [m]."""
DAMPINGS = 8
"""Tenfold ones that are tried before a way counts as the best of its kind."""
RESERVE = 0.004
"""Kept on top of the wanted clearance, for what motion adds to the quasi-static way [m]."""


@dataclass(frozen=True)
class Trial:
    """A way and what it costs."""

    displacements: Float64[np.ndarray, "k 2 6"]
    """Of each block: translation [m] and rotation [rad]."""
    cost: float
    nodes: Float64[np.ndarray, "h n 3"]
    final: RodState
    error: float
    """Mean node distance to the goal at the end [m]."""
    shortfall: float
    """Most that any point lacks of the wanted clearance [m]."""
    rope_near: NearPairs = field(repr=False)
    support_near: NearPairs = field(repr=False)
    body_near: NearPairs = field(repr=False)


class PathOptimisation:
    """One problem with its weights."""

    def __init__(self, problem: Problem, reserve: float = RESERVE) -> None:
        self.problem, self.reserve = problem, reserve
        self.margins = self._margins(problem.obstacles)
        self.lift = self._margins(problem.supports)
        self.block_of_step = np.concatenate(
            [np.repeat(np.arange(BLOCKS), STEPS), np.full(SETTLE, BLOCKS)]
        )
        self.packed = problem.packed_supports
        # What each block's displacement has contributed to a grip by the end of each step.
        block, step = np.divmod(np.arange(BLOCKS * STEPS), STEPS)
        share = np.clip(block[:, None] - np.arange(BLOCKS), 0, 1).astype(float)
        share[np.arange(len(block)), block] = (step + 1.0) / STEPS
        self.share = share
        self.turn = self._turns(0)
        if problem.moves[:, 3:].any():
            # The way of the ends decides how much twist is left in the rope: add what is missing.
            (straight,) = self._evaluated([self._straight()])
            missing = problem.turns - count_turns(straight.final)
            self.turn = self._turns(missing) if missing else self.turn

    @property
    def wanted(self) -> float:
        """Clearance of the whole way: what is asked for, or what start and goal leave [m]."""
        return min(self.problem.clearance, float(np.min(self.margins)))

    @property
    def goal_clearance(self) -> float:
        """What the goal itself leaves [m]."""
        problem = self.problem
        return geometry.chain_clearance(problem.goal, problem.radius, problem.obstacles)

    def trials(self, starts: Sequence[Float64[np.ndarray, "k 2 3"]]) -> list[Trial]:
        """All starts, rolled out in one launch."""
        return self._evaluated([np.concatenate([start, self.turn], axis=2) for start in starts])

    def again(self, trial: Trial) -> Trial:
        """A trial of another optimisation, weighed by this one."""
        return self._trial(trial.displacements, trial.nodes, trial.final)

    def refined(self, trial: Trial, iterations: int) -> Trial:
        """The way after some iterations of Gauss-Newton."""
        damping = 1e-3
        for _ in range(iterations):
            hessian, slope = self._normal_equations(trial)
            scale = np.diag(np.diag(hessian)) + 1e-6 * np.eye(len(hessian))
            for _ in range(DAMPINGS):
                step = -np.linalg.solve(hessian + damping * scale, slope)
                change = np.zeros_like(trial.displacements)
                change[:, self.problem.moves] = step.reshape(BLOCKS, -1)
                (better,) = self._evaluated([trial.displacements + change])
                if better.cost < trial.cost:
                    break
                damping = min(10.0 * damping, 1e6)
            else:
                return trial
            gain = trial.cost - better.cost
            trial, damping = better, max(0.2 * damping, 1e-7)
            if gain < 1e-3 * trial.cost + 1e-4:
                break
        return trial

    def grips(
        self, displacements: Float64[np.ndarray, "k 2 6"]
    ) -> tuple[Float64[np.ndarray, "s 2 3"], Float64[np.ndarray, "s 2 4"]]:
        """Positions [m] and orientations of both grips, first now and then after every step."""
        begin = np.stack([g.position for g in self.problem.grips])
        q = np.stack([g.orientation for g in self.problem.grips])
        positions = begin + np.einsum("sk,kec->sec", self.share, displacements[..., :3])
        if not displacements[..., 3:].any():
            still = np.repeat(q[None], len(positions) + 1, axis=0)
            return np.concatenate([begin[None], positions]), still
        turns = np.repeat(displacements[..., 3:] / STEPS, STEPS, axis=0)
        orientations = [q]
        for turn in turns:
            q = poses.normalized(poses.multiply(poses.exponential(turn), q))
            orientations.append(q)
        return np.concatenate([begin[None], positions]), np.array(orientations)

    def _actions(self, displacements: Float64[np.ndarray, "k 2 6"]) -> np.ndarray:
        still = np.zeros((1, 2, 6))
        return np.concatenate([displacements / (STEPS * STEP_TIME), still])

    def _evaluated(self, ways: Sequence[Float64[np.ndarray, "k 2 6"]]) -> list[Trial]:
        rollouts = self.problem.rod.rollout(
            RolloutSpec(
                [self.problem.state] * len(ways),
                np.stack([self._actions(way) for way in ways]),
                STEP_TIME,
                block_of_step=self.block_of_step,
                obstacles=self.packed,
            )
        )
        return [
            self._trial(way, r.positions, r.final) for way, r in zip(ways, rollouts, strict=True)
        ]

    def _trial(
        self,
        way: Float64[np.ndarray, "k 2 6"],
        nodes: Float64[np.ndarray, "h n 3"],
        final: RodState,
    ) -> Trial:
        problem = self.problem
        miss = nodes[-1] - problem.goal
        cost = MILLIMETRE**2 * float(np.mean(np.sum(miss**2, axis=1)))
        rope, rope_lack = self._rope_near(nodes, problem.obstacles, self.margins)
        support, support_lack = self._rope_near(nodes, problem.supports, self.lift)
        cost += (MILLIMETRE * LIFTING) ** 2 * float(support_lack @ support_lack)
        bodies = self._bodies(way)
        wanted = max(problem.clearance, problem.limits.keep_out) + self.reserve
        wanted += problem.limits.gripper_radius
        body = near_pairs(bodies, problem.solid, np.full(len(bodies), wanted))
        body_lack = wanted - body.distances
        cost += (MILLIMETRE * NEARNESS) ** 2 * float(rope_lack @ rope_lack + body_lack @ body_lack)
        for residual, _ in self._grip_residuals(way):
            cost += float(residual @ residual)
        return Trial(
            way,
            cost,
            nodes,
            final,
            float(np.mean(np.linalg.norm(miss, axis=1))),
            max(float(np.max(rope_lack, initial=0.0)), float(np.max(body_lack, initial=0.0)))
            - self.reserve,
            rope,
            support,
            body,
        )

    def _rope_near(
        self,
        nodes: Float64[np.ndarray, "h n 3"],
        obstacles: Sequence[Obstacle],
        margins: Float64[np.ndarray, "s"],
    ) -> tuple[NearPairs, Float64[np.ndarray, "a"]]:
        """Where the rope is nearer to obstacles than its margin at each step, and by how much."""
        points = with_midpoints(nodes[: BLOCKS * STEPS]).reshape(-1, 3)
        reach = np.repeat(margins + self.problem.radius, 2 * self.problem.rod.node_count - 1)
        found = near_pairs(points, obstacles, reach)
        return found, reach[found.points] - found.distances

    def _bodies(self, way: Float64[np.ndarray, "k 2 6"]) -> Float64[np.ndarray, "p 3"]:
        positions, orientations = self.grips(way)
        reach = self.problem.limits.gripper_reach
        return swept_gripper_points(positions[1:], orientations[1:], reach)

    def _normal_equations(
        self, trial: Trial
    ) -> tuple[Float64[np.ndarray, "v v"], Float64[np.ndarray, "v"]]:
        problem = self.problem
        moves = problem.moves
        linear = problem.rod.linearize(
            RolloutSpec(
                problem.state,
                self._actions(trial.displacements),
                STEP_TIME,
                block_of_step=self.block_of_step,
                obstacles=self.packed,
            )
        )
        slopes = linear.d_positions_d_actions[:, :, :, :BLOCKS] / (STEPS * STEP_TIME)
        rows, residuals = [], []
        count = problem.rod.node_count
        scale = MILLIMETRE / np.sqrt(count)
        rows.append(scale * slopes[-1][..., moves].reshape(3 * count, -1))
        residuals.append(scale * (trial.nodes[-1] - problem.goal).ravel())
        for hit, margins, weight in (
            (trial.rope_near, self.margins, NEARNESS),
            (trial.support_near, self.lift, LIFTING),
        ):
            if not len(hit.points):
                continue
            step, at = np.divmod(hit.points, 2 * count - 1)
            first = np.where(at < count, at, at - count)
            second = np.where(at < count, at, at - count + 1)
            here = 0.5 * (slopes[step, first] + slopes[step, second])
            along = np.einsum("ac,ackem->akem", hit.normals, here)
            rows.append(-MILLIMETRE * weight * along[..., moves].reshape(len(step), -1))
            lack = margins[step] + problem.radius - hit.distances
            residuals.append(MILLIMETRE * weight * lack)
        hit = trial.body_near
        if len(hit.points):
            step, at = np.divmod(hit.points, 6)
            end = at // 3
            along = np.zeros((len(step), BLOCKS, 2, 6))
            along[np.arange(len(step)), :, end, :3] = (
                self.share[step][:, :, None] * hit.normals[:, None, :]
            )
            rows.append(-MILLIMETRE * NEARNESS * along[..., moves].reshape(len(step), -1))
            wanted = max(problem.clearance, problem.limits.keep_out) + self.reserve
            lack = wanted + problem.limits.gripper_radius - hit.distances
            residuals.append(MILLIMETRE * NEARNESS * lack)
        for residual, row in self._grip_residuals(trial.displacements):
            rows.append(row[..., moves].reshape(len(residual), -1))
            residuals.append(residual)
        jacobian, residual = np.concatenate(rows), np.concatenate(residuals)
        return jacobian.T @ jacobian, jacobian.T @ residual

    def _grip_residuals(
        self, way: Float64[np.ndarray, "k 2 6"]
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """What does not depend on the rope: effort, smoothness, reach of the grips, workspace."""
        problem = self.problem
        limits = problem.limits
        # A radian counts as much as the rope's length over two pi.
        unit = np.where(np.arange(6) < 3, 1.0, problem.rod.properties.length / (2.0 * np.pi))
        unit = unit * MILLIMETRE
        identity = np.eye(BLOCKS * 12).reshape(BLOCKS, 2, 6, BLOCKS, 2, 6)
        scaled = identity * unit[None, None, :, None, None, None]
        around = np.pad(way * unit, ((1, 1), (0, 0), (0, 0)))
        bend = np.pad(scaled, ((1, 1), (0, 0), (0, 0), (0, 0), (0, 0), (0, 0)))
        size = (-1, BLOCKS, 2, 6)
        found = [
            (EFFORT * (way * unit).ravel(), EFFORT * scaled.reshape(size)),
            (
                SMOOTHNESS * np.diff(around, axis=0).ravel(),
                SMOOTHNESS * np.diff(bend, axis=0).reshape(size),
            ),
        ]
        for end, oriented in enumerate(problem.oriented):
            if oriented:
                row = scaled[:, end, 3:].sum(axis=0)
                miss = (way - np.pad(self.turn, ((0, 0), (0, 0), (3, 0))))[:, end, 3:]
                found.append((unit[3:] * miss.sum(axis=0), row))
        positions, orientations = (part[1:] for part in self.grips(way))
        chord = positions[:, 1] - positions[:, 0]
        distance = np.linalg.norm(chord, axis=1)
        direction = chord / np.maximum(distance, 1e-9)[:, None]
        most = PATH_STRETCH_SHARE * limits.overstretch * problem.rod.properties.length
        bodies = gripper_axis_distance(positions, orientations, limits.gripper_reach)
        for apart, towards, least, farthest in (
            (distance, direction, limits.spacing + PATH_SPACING_MARGIN, most),
            (*bodies, axis_spacing(limits.gripper_radius, limits.keep_out) + self.reserve, np.inf),
        ):
            (bad,) = np.nonzero((apart > farthest) | (apart < least))
            if len(bad):
                excess = apart[bad] - np.clip(apart[bad], least, farthest)
                row = np.zeros((len(bad), BLOCKS, 2, 6))
                pull = self.share[bad][:, :, None] * towards[bad][:, None, :]
                row[:, :, 1, :3], row[:, :, 0, :3] = pull, -pull
                weight = CROWDING * MILLIMETRE
                found.append((weight * excess, weight * row))
        low, high = np.array(limits.workspace) + np.array(
            [[PATH_WORKSPACE_MARGIN], [-PATH_WORKSPACE_MARGIN]]
        )
        outside = positions - np.clip(positions, low, high)
        step, end, axis = np.nonzero(outside)
        if len(step):
            row = np.zeros((len(step), BLOCKS, 2, 6))
            row[np.arange(len(step)), :, end, axis] = self.share[step]
            found.append((MILLIMETRE * outside[step, end, axis], MILLIMETRE * row))
        return found

    def _margins(self, obstacles: Sequence[Obstacle]) -> Float64[np.ndarray, "s"]:
        """Clearance to keep at each step [m]: the rope may begin and end nearer to things."""
        problem = self.problem
        steps = np.arange(BLOCKS * STEPS)
        wanted = np.full(len(steps), problem.clearance + self.reserve)
        for nodes, away in ((problem.state.positions, steps), (problem.goal, steps[::-1])):
            own = geometry.chain_clearance(nodes, problem.radius, obstacles)
            beyond = np.maximum(away / STEPS - NEAR_BLOCKS, 0.0)
            wanted = np.minimum(wanted, own - LEAVING + PARTING * beyond)
        return wanted

    def _straight(self) -> Float64[np.ndarray, "k 2 6"]:
        """Evenly from here to the goal's grips."""
        problem = self.problem
        pairs = zip(problem.goal_grips, problem.grips, strict=True)
        whole = np.stack([b.position - a.position for b, a in pairs]) * problem.moves[:, :3]
        return np.concatenate([np.tile(whole / BLOCKS, (BLOCKS, 1, 1)), self.turn], axis=2)

    def _turns(self, spins: int) -> Float64[np.ndarray, "k 2 3"]:
        """Rotation of each grip in each block: evenly from here to the goal's orientations.

        Args:
            spins: Whole turns to add to the rope's twist; both ends share them where both rotate.
        """
        problem = self.problem
        turns = np.zeros((BLOCKS, 2, 3))
        rotates = problem.moves[:, 3:].any(axis=1)
        left = -int(np.fix(spins / 2)) if rotates.all() else -spins * int(rotates[0])
        shares = (left, spins + left)
        s = np.linspace(0.0, 1.0, BLOCKS + 1)[:, None]
        for end, (now, goal) in enumerate(zip(problem.grips, problem.goal_grips, strict=True)):
            if rotates[end]:
                whole = poses.logarithm(
                    poses.multiply(goal.orientation, poses.conjugate(now.orientation))
                )
                spun = poses.exponential(2.0 * np.pi * shares[end] * s * EDGE_AXIS)
                here = np.broadcast_to(now.orientation, spun.shape)
                ways = poses.multiply(poses.multiply(poses.exponential(s * whole), here), spun)
                steps = poses.multiply(ways[1:], poses.conjugate(ways[:-1]))
                turns[:, end] = poses.logarithm(steps)
        return turns
