"""The paper's own ways to use the horizon: eq. (12) and (13) by Adam, through the rod.

`network` trains the paper's network in every horizon and keeps its weights between horizons;
`actions` puts Adam on the velocities themselves, the paper's ablation, with a shifted start.

Readings: the norm in (12) is the sum of node distances, with the weights as printed (as a mean the
speed's weight holds the rope back, 6 cm of progress in 4 s); u holds the velocities of the free
components; d of (13) is taken from a node, as printed, not from the rope's surface. What is learnt
is bounded in speed and in the distance of the ends before the rod sees it: the paper does not say
what keeps its ends together, and an untrained network pulls them apart until the rod breaks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.clearance import near
from lariat.geometry.obstacles import Obstacle, pack, signed_distance
from lariat.rod import Gradient, Rod
from lariat.rod.xpbd import Slope, XpbdRod
from services.controller.mpc.constraints import within_reach
from services.controller.mpc.gauss_newton import Horizon, HorizonPlan
from services.controller.mpc.motion import Bounds
from services.controller.mpc.objective import Surroundings
from services.controller.paper.policies import Policy
from shared.scenario.sections import PaperControl

NEAREST = 1e-3
"""Distance below which (13) grows no more [m]."""
FAR = 0.15
"""No node gets nearer to an obstacle by more within a horizon [m]."""


class PaperMethod:
    """Plans one horizon after the other as Algorithm 2 does."""

    def __init__(
        self,
        policy: Policy,
        settings: PaperControl,
        moves: Bool[np.ndarray, "2 6"],
        bounds: Bounds,
    ) -> None:
        self.policy, self.settings, self.moves, self.bounds = policy, settings, moves, bounds
        self._elapsed = 0.0

    def restart(self) -> None:
        """What was learnt is kept."""

    def moved_on(self, elapsed: float) -> None:
        """The next horizon begins so much after the last one [s]."""
        self._elapsed += elapsed

    def plan(self, rod: Rod | XpbdRod, horizon: Horizon, surroundings: Surroundings) -> HorizonPlan:
        """The velocities of this horizon."""
        s = self.settings
        count = len(horizon.reference)
        before = np.repeat((horizon.state.positions + horizon.offset)[None], count, axis=0)
        goal = horizon.reference[-1]
        passed = round(self._elapsed / s.time_step)
        self._elapsed -= passed * s.time_step
        self.policy.begin(passed)
        field = _Field(before[0], surroundings.obstacles, s.obstacle_distance)
        obstacles = pack(field.obstacles)
        nodes, cost = before, {}
        for _ in range(s.optimizer_steps):
            wanted = self._bounded(self.policy.velocities(before, goal), horizon, surroundings)

            def pull(
                positions: Float64[np.ndarray, "h n 3"],
                wanted: Float64[np.ndarray, "h 2 6"] = wanted,
            ) -> Float64[np.ndarray, "h n 3"]:
                nonlocal nodes, cost
                nodes = positions + horizon.offset
                cost, slope = self._loss(nodes, wanted, horizon, field)
                return slope

            answer = _carried_back(
                rod, horizon, horizon.path + wanted, s.time_step, obstacles, pull
            )
            slope = answer.actions + 2.0 * s.speed_weight / count * wanted
            self.policy.learn(slope[:, self.moves])
            before = np.concatenate([before[:1], nodes[:-1]])
        wanted = self._bounded(self.policy.velocities(before, goal), horizon, surroundings)
        return HorizonPlan(wanted.reshape(count, 2, 2, 3), nodes, cost, s.optimizer_steps)

    def _bounded(
        self,
        free: Float64[np.ndarray, "h m"],
        horizon: Horizon,
        surroundings: Surroundings,
    ) -> Float64[np.ndarray, "h 2 6"]:
        """On top of the path's, within the bounds on speed, the ends within the rope's reach."""
        velocities = np.zeros((len(free), 2, 6))
        velocities[:, self.moves] = free
        together = within_reach(
            horizon.path + self._slow(velocities),
            self.moves,
            horizon.state.positions[[0, -1]],
            self.settings.time_step,
            surroundings.most_apart,
        )
        # Slower than what keeps the ends together keeps them together as well.
        return self._slow(together - horizon.path)

    def _slow(self, velocities: Float64[np.ndarray, "h 2 6"]) -> Float64[np.ndarray, "h 2 6"]:
        """No faster than the bounds."""
        sizes = np.linalg.norm(velocities.reshape(-1, 2, 2, 3), axis=3)
        shares = np.minimum(1.0, self.bounds.speed[:, 0] / np.maximum(sizes, 1e-300))
        return velocities * np.repeat(shares, 3, axis=2)

    def _loss(
        self,
        nodes: Float64[np.ndarray, "h n 3"],
        velocities: Float64[np.ndarray, "h 2 6"],
        horizon: Horizon,
        field: _Field,
    ) -> tuple[dict[str, float], Float64[np.ndarray, "h n 3"]]:
        """Terms of (12), and its slope in the nodes."""
        s, count = self.settings, len(nodes)
        miss = nodes - horizon.reference
        distance = np.maximum(np.linalg.norm(miss, axis=2, keepdims=True), 1e-9)
        slope = s.error_weight / count * miss / distance
        potential, pull = field.potential(nodes)
        slope = slope + s.obstacle_weight / count * pull
        return {
            "error": s.error_weight / count * float(np.sum(distance)),
            "obstacles": s.obstacle_weight / count * potential,
            "speed": s.speed_weight / count * float(np.sum(velocities**2)),
        }, slope


def _carried_back(
    rod: Rod | XpbdRod,
    horizon: Horizon,
    actions: Float64[np.ndarray, "h 2 6"],
    dt: float,
    obstacles: Float64[np.ndarray, "m 12"],
    slope: Slope,
) -> Gradient:
    """The roll-out and its gradient, where the cost's slope depends on the roll-out."""
    given = slope
    if isinstance(rod, Rod):
        given = slope(rod.rollout(horizon.state, actions, dt, obstacles=obstacles).positions)
    return rod.gradient(
        horizon.state, actions, dt, obstacles=obstacles, parameters=(), d_cost_d_positions=given
    )


class _Field:
    """The repulsive potential (13) during one horizon."""

    def __init__(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        obstacles: Sequence[Obstacle],
        reach: float,
    ) -> None:
        """
        Args:
            nodes: Where the horizon begins [m].
            obstacles: Those beyond `FAR` are left out.
            reach: epsilon_d [m].
        """
        self._nodes, self._reach = nodes, reach
        distances = [float(np.min(signed_distance(nodes, o))) - reach for o in obstacles]
        near_ones = [(o, d) for o, d in zip(obstacles, distances, strict=True) if d < FAR]
        self._distances = [d for _, d in near_ones]
        self.obstacles = tuple(o for o, _ in near_ones)

    def potential(
        self, nodes: Float64[np.ndarray, "h n 3"]
    ) -> tuple[float, Float64[np.ndarray, "h n 3"]]:
        """U summed over all nodes [1/m^2], and its slope."""
        slope = np.zeros_like(nodes)
        # A distance changes by no more than the way.
        moved = math.sqrt(np.max(np.sum((nodes - self._nodes) ** 2, axis=2)))
        acting = [o for o, d in zip(self.obstacles, self._distances, strict=True) if d < moved]
        if not acting:
            return 0.0, slope
        points = nodes.reshape(-1, 3)
        hits = near(points, acting, np.full(len(points), self._reach))
        d = np.maximum(hits.distances, NEAREST)
        lack = 1.0 / d - 1.0 / self._reach
        pull = -2.0 * (lack / d**2)[:, None] * hits.normals
        np.add.at(slope.reshape(-1, 3), hits.points, pull)
        return float(lack @ lack), slope
