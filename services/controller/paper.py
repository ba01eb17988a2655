"""The paper's own ways to use the horizon: eq. (12) and (13) by Adam, through the rod.

`network` trains the paper's network in every horizon and keeps its weights between horizons;
`actions` puts Adam on the velocities themselves, the paper's ablation, with a shifted start.

Readings: the norm in (12) is the sum of node distances; u holds the velocities of the free
components. The network sees the nodes of the iteration before, so an iteration costs one adjoint of
the whole horizon; over a horizon of 50 ms those nodes hardly differ from the present ones. Its
outputs are taken as independent of how they moved its own inputs, for the same reason.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from jaxtyping import Bool, Float64

from services.controller.gauss_newton import Horizon, HorizonPlan
from services.controller.motion import Bounds, clipped
from services.controller.objective import Surroundings
from shared.geometry.clearance import near
from shared.rod import Rod
from shared.scenario.sections import PaperControl

if TYPE_CHECKING:
    import torch

ACTIONS_RATE = 0.03
"""Learning rate of Adam on the velocities: a well tuned one. The paper does not give its own."""
HIDDEN = 256
"""Width of both hidden layers."""
NEAREST = 1e-3
"""Distance below which (13) grows no more [m]."""
BETAS, EPSILON = (0.9, 0.999), 1e-8
"""Adam's own defaults."""


class Policy(Protocol):
    """What is trained: gives velocities, takes the loss's slope in them."""

    def begin(self) -> None:
        """A new horizon."""
        ...

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        """Of the free components at each step, from the nodes before it [m/s, rad/s]."""
        ...

    def learn(self, slope: Float64[np.ndarray, "h m"]) -> None:
        """One step of Adam, given the slope of the loss in the velocities."""
        ...


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

    def restart(self) -> None:
        """Weights are kept between horizons; nothing else is."""

    def moved_on(self, elapsed: float) -> None:
        """Time passes by itself."""

    def plan(self, rod: Rod, horizon: Horizon, surroundings: Surroundings) -> HorizonPlan:
        """The velocities of this horizon."""
        s = self.settings
        count = len(horizon.reference)
        before = np.repeat((horizon.state.positions + horizon.offset)[None], count, axis=0)
        goal = horizon.reference[-1]
        self.policy.begin()
        nodes, cost = before, {}
        for _ in range(s.optimizer_steps):
            wanted = self._bounded(self.policy.velocities(before, goal))
            actions = horizon.path + wanted
            nodes = rod.rollout(horizon.state, actions, s.time_step).positions + horizon.offset
            cost, pull = self._loss(nodes, wanted, horizon, surroundings)
            answer = rod.gradient(
                horizon.state, actions, s.time_step, parameters=(), d_cost_d_positions=pull
            )
            slope = answer.actions + 2.0 * s.speed_weight / count * wanted
            self.policy.learn(slope[:, self.moves])
            before = np.concatenate([before[:1], nodes[:-1]])
        wanted = self._bounded(self.policy.velocities(before, goal))
        return HorizonPlan(wanted.reshape(count, 2, 2, 3), nodes, cost, s.optimizer_steps)

    def _bounded(self, free: Float64[np.ndarray, "h m"]) -> Float64[np.ndarray, "h 2 6"]:
        velocities = np.zeros((len(free), 2, 6))
        velocities[:, self.moves] = free
        rows = [clipped(v.reshape(2, 2, 3), self.bounds.speed).reshape(2, 6) for v in velocities]
        return np.stack(rows)

    def _loss(
        self,
        nodes: Float64[np.ndarray, "h n 3"],
        velocities: Float64[np.ndarray, "h 2 6"],
        horizon: Horizon,
        surroundings: Surroundings,
    ) -> tuple[dict[str, float], Float64[np.ndarray, "h n 3"]]:
        """Terms of (12), and its slope in the nodes."""
        s, count = self.settings, len(nodes)
        miss = nodes - horizon.reference
        distance = np.maximum(np.linalg.norm(miss, axis=2, keepdims=True), 1e-9)
        slope = s.error_weight / count * miss / distance
        points = nodes.reshape(-1, 3)
        hits = near(points, surroundings.obstacles, np.full(len(points), s.obstacle_distance))
        d = np.maximum(hits.distances, NEAREST)
        lack = 1.0 / d - 1.0 / s.obstacle_distance
        pull = -2.0 * s.obstacle_weight / count * (lack / d**2)[:, None] * hits.normals
        np.add.at(slope.reshape(-1, 3), hits.points, pull)
        return {
            "error": s.error_weight / count * float(np.sum(distance)),
            "obstacles": s.obstacle_weight / count * float(lack @ lack),
            "speed": s.speed_weight / count * float(np.sum(velocities**2)),
        }, slope


class Actions:
    """Adam on the velocities themselves."""

    def __init__(self, horizon: int, count: int) -> None:
        """
        Args:
            horizon: Steps.
            count: Free components.
        """
        self._values = np.zeros((horizon, count))
        self.begin()

    def begin(self) -> None:
        self._values = np.concatenate([self._values[1:], self._values[-1:]])
        self._first, self._second = np.zeros_like(self._values), np.zeros_like(self._values)
        self._steps = 0

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        return self._values

    def learn(self, slope: Float64[np.ndarray, "h m"]) -> None:
        self._steps += 1
        a, b = BETAS
        self._first = a * self._first + (1.0 - a) * slope
        self._second = b * self._second + (1.0 - b) * slope**2
        mean = self._first / (1.0 - a**self._steps)
        spread = np.sqrt(self._second / (1.0 - b**self._steps))
        self._values = self._values - ACTIONS_RATE * mean / (spread + EPSILON)


class Network:
    """The paper's network: nodes and goal in, velocities out."""

    def __init__(self, nodes: int, count: int, rate: float, seed: int) -> None:
        """
        Args:
            nodes: Of the rope.
            count: Free components.
            rate: Learning rate of Adam.
            seed: Of the first weights.
        """
        import torch

        torch.set_num_threads(1)
        generator = torch.Generator().manual_seed(seed)
        sizes = (6 * nodes, HIDDEN, HIDDEN, count)
        self._torch: Any = torch
        self._weights: list[torch.Tensor] = []
        for inputs, outputs in pairwise(sizes):
            bound = inputs**-0.5
            for shape in ((outputs, inputs), (outputs,)):
                values = torch.rand(shape, generator=generator, dtype=torch.float64)
                self._weights.append(((2.0 * values - 1.0) * bound).requires_grad_())
        self._optimiser = torch.optim.Adam(self._weights, lr=rate)
        self._outputs: torch.Tensor | None = None

    def begin(self) -> None:
        """Weights are kept."""

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        torch = self._torch
        seen = nodes.reshape(len(nodes), -1)
        wanted = np.broadcast_to(goal.ravel(), seen.shape)
        values = torch.from_numpy(np.concatenate([seen, wanted], axis=1))
        layers = list(zip(self._weights[::2], self._weights[1::2], strict=True))
        for k, (weight, bias) in enumerate(layers):
            values = values @ weight.T + bias
            if k < len(layers) - 1:
                values = torch.relu(values)
        self._outputs = values
        return values.detach().numpy().copy()

    def learn(self, slope: Float64[np.ndarray, "h m"]) -> None:
        outputs = self._outputs
        assert outputs is not None
        self._optimiser.zero_grad()
        outputs.backward(self._torch.from_numpy(np.ascontiguousarray(slope)))
        self._optimiser.step()
