"""Horizon optimizer of the paper: eq. (12) and (13) by Adam, through the rod (Algorithm 2).

The method `network` trains the paper's network in every horizon and keeps its weights between
horizons; `actions` applies Adam to the velocities themselves, the paper's ablation, with a shifted
start.

Interpretation: the norm in (12) is the sum of node distances, with the weights as printed (with
their mean, by which the paper defines its error, the speed's weight holds the rope back); u holds
the velocities of the free components; d of (13) is the distance of a node, as printed, not of the
rope's surface.
Velocities are bounded in speed and in the distance of the ends before the roll-out: the paper
states no such bound, and an untrained network pulls the ends apart until the rod breaks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.constraints import limit_grip_distance
from lariat.control.mpc.horizon import HorizonPlan, HorizonProblem
from lariat.geometry.near_pairs import near_pairs
from lariat.geometry.obstacles import Obstacle, pack, signed_distance
from lariat.rod import DifferentiableRod, RodState, RolloutSpec
from lariat.scenario.sections import PaperControl
from lariat.trajectory import MotionLimits

MIN_POTENTIAL_DISTANCE = 1e-3
"""Distance below which the potential of eq. (13) grows no further [m]."""
MAX_APPROACH = 0.15
"""Maximum approach of a node to an obstacle within a horizon [m]."""


class Policy(Protocol):
    """Trainable map from nodes and goal to velocities."""

    def begin(self, elapsed_steps: int) -> None:
        """Begin a horizon.

        Args:
            elapsed_steps: Steps since the beginning of the last horizon.
        """
        ...

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        """Velocities of the free components in each step [m/s, rad/s].

        Args:
            nodes: Nodes before each step [m].
            goal: Nodes of the goal [m].
        """
        ...

    def learn(self, gradient: Float64[np.ndarray, "h m"]) -> None:
        """Take one step of Adam.

        Args:
            gradient: Gradient of the loss with respect to the velocities returned last.
        """
        ...

    def gradient_in_nodes(
        self, gradient: Float64[np.ndarray, "h m"], nodes: Float64[np.ndarray, "h n 3"]
    ) -> Float64[np.ndarray, "h n 3"]:
        """Gradient of the loss with respect to the nodes before each step, through the policy.

        Args:
            gradient: Gradient of the loss with respect to the velocities returned last.
            nodes: Nodes for which these velocities were returned [m].
        """
        ...


class PaperOptimizer:
    """Horizon optimizer by Adam on a policy."""

    interpolation: Literal["constant", "linear"] = "constant"
    """Velocity within a step: constant."""

    def __init__(
        self,
        policy: Policy,
        settings: PaperControl,
        moves: Bool[np.ndarray, "2 6"],
        limits: MotionLimits,
        differentiates_inputs: bool = False,
    ) -> None:
        """Create an optimizer of a policy.

        Args:
            policy: Network or velocities that Adam trains.
            settings: Weights and steps of the paper.
            moves: Free components of each grip's velocity.
            limits: Limits on the velocities.
            differentiates_inputs: Whether the policy sees the nodes of the present iteration, and
                the gradient includes their dependence on earlier velocities, as in the paper. A
                horizon of H steps then needs 2 H - 1 launches an iteration instead of one.
        """
        self.policy, self.settings, self.moves, self.limits = policy, settings, moves, limits
        self.differentiates_inputs = differentiates_inputs
        self._elapsed = 0.0

    @property
    def step_count(self) -> int:
        """Steps of a horizon."""
        return self.settings.horizon

    @property
    def time_step(self) -> float:
        """Duration of a step [s]."""
        return self.settings.time_step

    @property
    def executed_step_count(self) -> int:
        """Steps before the next plan: the paper executes a horizon whole."""
        return self.settings.horizon

    def reset(self) -> None:
        """Keep the policy: the paper trains it from horizon to horizon."""

    def shift(self, elapsed: float) -> None:
        """Shift the policy in time with the next plan [s]."""
        self._elapsed += elapsed

    def plan(
        self, rod: DifferentiableRod, problem: HorizonProblem, avoidance: AvoidanceSpecification
    ) -> HorizonPlan:
        """Solve a horizon, as of `HorizonOptimizer`; the goal is its last reference shape."""
        s = self.settings
        count = len(problem.reference)
        inputs = np.repeat((problem.state.positions + problem.offset)[None], count, axis=0)
        goal = problem.reference[-1]
        elapsed_steps = round(self._elapsed / s.time_step)
        self._elapsed -= elapsed_steps * s.time_step
        self.policy.begin(elapsed_steps)
        field = _RepulsivePotential(inputs[0], avoidance.obstacles, s.obstacle_distance)
        obstacles = pack(field.obstacles)
        nodes, cost, seed = inputs, {}, inputs

        def rollout_of(velocities: Float64[np.ndarray, "h 2 6"]) -> RolloutSpec[RodState]:
            return RolloutSpec(
                problem.state, problem.path + velocities, s.time_step, obstacles=obstacles
            )

        for _ in range(s.optimizer_steps):
            for _ in range(count - 1 if self.differentiates_inputs else 0):
                # Nodes before a step follow from the steps before it: they are exact at the end.
                velocities = self._bounded(self.policy.velocities(inputs, goal), problem, avoidance)
                rolled = rod.rollout(rollout_of(velocities)).positions + problem.offset
                inputs = np.concatenate([inputs[:1], rolled[:-1]])
            velocities = self._bounded(self.policy.velocities(inputs, goal), problem, avoidance)
            spec = rollout_of(velocities)

            def cost_gradient(
                positions: Float64[np.ndarray, "h n 3"],
                velocities: Float64[np.ndarray, "h 2 6"] = velocities,
            ) -> Float64[np.ndarray, "h n 3"]:
                nonlocal nodes, cost, seed
                nodes = positions + problem.offset
                cost, seed = self._loss(nodes, velocities, problem, field)
                return seed

            of_speed = 2.0 * s.speed_weight / count * velocities
            gradient = rod.gradient(spec, cost_gradient, parameters=()).actions + of_speed
            for _ in range(count - 1 if self.differentiates_inputs else 0):
                # Velocities of a step act on later ones through the nodes: exact at the end, too.
                through_inputs = self.policy.gradient_in_nodes(gradient[:, self.moves], inputs)
                whole = seed + np.concatenate([through_inputs[1:], np.zeros_like(inputs[:1])])
                gradient = rod.gradient(spec, whole, parameters=()).actions + of_speed
            self.policy.learn(gradient[:, self.moves])
            inputs = np.concatenate([inputs[:1], nodes[:-1]])
        velocities = self._bounded(self.policy.velocities(inputs, goal), problem, avoidance)
        return HorizonPlan(velocities.reshape(count, 2, 2, 3), nodes, cost, s.optimizer_steps)

    def _bounded(
        self,
        free: Float64[np.ndarray, "h m"],
        problem: HorizonProblem,
        avoidance: AvoidanceSpecification,
    ) -> Float64[np.ndarray, "h 2 6"]:
        """Velocities within the limits on speed and on the distance of the ends."""
        velocities = np.zeros((len(free), 2, 6))
        velocities[:, self.moves] = free
        limited = limit_grip_distance(
            problem.path + self._speed_limited(velocities),
            self.moves,
            problem.state.positions[[0, -1]],
            self.settings.time_step,
            avoidance.max_grip_distance,
        )
        # Scaled down, velocities that keep the distance of the ends within its limit still do so.
        return self._speed_limited(limited - problem.path)

    def _speed_limited(
        self, velocities: Float64[np.ndarray, "h 2 6"]
    ) -> Float64[np.ndarray, "h 2 6"]:
        """Velocities scaled down to the limits on speed."""
        sizes = np.linalg.norm(velocities.reshape(-1, 2, 2, 3), axis=3)
        shares = np.minimum(1.0, self.limits.speed_bounds[:, 0] / np.maximum(sizes, 1e-300))
        return velocities * np.repeat(shares, 3, axis=2)

    def _loss(
        self,
        nodes: Float64[np.ndarray, "h n 3"],
        velocities: Float64[np.ndarray, "h 2 6"],
        problem: HorizonProblem,
        field: _RepulsivePotential,
    ) -> tuple[dict[str, float], Float64[np.ndarray, "h n 3"]]:
        """Terms of eq. (12), and the gradient of their sum with respect to the nodes."""
        s, count = self.settings, len(nodes)
        miss = nodes - problem.reference
        distance = np.maximum(np.linalg.norm(miss, axis=2, keepdims=True), 1e-9)
        gradient = s.error_weight / count * miss / distance
        potential, d_potential = field.potential(nodes)
        gradient = gradient + s.obstacle_weight / count * d_potential
        return {
            "error": s.error_weight / count * float(np.sum(distance)),
            "obstacles": s.obstacle_weight / count * potential,
            "speed": s.speed_weight / count * float(np.sum(velocities**2)),
        }, gradient


class _RepulsivePotential:
    """Repulsive potential of eq. (13) during one horizon."""

    def __init__(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        obstacles: Sequence[Obstacle],
        reach: float,
    ) -> None:
        """Select the obstacles near enough to act on the rope.

        Args:
            nodes: Nodes at the beginning of the horizon [m].
            obstacles: Obstacles of the scene; those beyond `MAX_APPROACH` are left out.
            reach: Distance epsilon_d at which the potential begins [m].
        """
        self._nodes, self._reach = nodes, reach
        distances = [float(np.min(signed_distance(nodes, o))) - reach for o in obstacles]
        near = [(o, d) for o, d in zip(obstacles, distances, strict=True) if d < MAX_APPROACH]
        self._distances = [d for _, d in near]
        self.obstacles = tuple(o for o, _ in near)

    def potential(
        self, nodes: Float64[np.ndarray, "h n 3"]
    ) -> tuple[float, Float64[np.ndarray, "h n 3"]]:
        """Potential U summed over all nodes [1/m^2], and its gradient."""
        gradient = np.zeros_like(nodes)
        # A distance changes by no more than the displacement.
        moved = math.sqrt(np.max(np.sum((nodes - self._nodes) ** 2, axis=2)))
        acting = [o for o, d in zip(self.obstacles, self._distances, strict=True) if d < moved]
        if not acting:
            return 0.0, gradient
        points = nodes.reshape(-1, 3)
        hits = near_pairs(points, acting, np.full(len(points), self._reach))
        d = np.maximum(hits.distances, MIN_POTENTIAL_DISTANCE)
        inverse_excess = 1.0 / d - 1.0 / self._reach
        per_contact = -2.0 * (inverse_excess / d**2)[:, None] * hits.normals
        np.add.at(gradient.reshape(-1, 3), hits.points, per_contact)
        return float(inverse_excess @ inverse_excess), gradient
