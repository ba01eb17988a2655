"""Policies that the paper trains in a horizon: its network, or the velocities themselves.

The network's input are the nodes of the iteration before, so that one launch rolls a horizon out
and one carries its loss back; the dependence of that input on the network's own outputs is
neglected, unless `PaperOptimizer` differentiates through it.
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float64

ACTIONS_RATE = 0.03
"""Learning rate of Adam on the velocities [m/s], tuned; the paper does not state its own."""
HIDDEN_WIDTH = 256
"""Width of both hidden layers."""


class Actions:
    """Adam on the velocities themselves, which do not depend on the nodes."""

    def __init__(self, step_count: int, component_count: int, rate: float = ACTIONS_RATE) -> None:
        """Create velocities of zero.

        Args:
            step_count: Steps of a horizon.
            component_count: Free components of the grips' velocities.
            rate: Learning rate of Adam [m/s].
        """
        self._rate = rate
        self._values = torch.zeros((step_count, component_count), dtype=torch.float64)
        self.begin(0)

    def begin(self, elapsed_steps: int) -> None:
        """Shift the velocities in time and restart Adam."""
        last = len(self._values) - 1
        shifted = np.minimum(np.arange(len(self._values)) + elapsed_steps, last)
        self._values = self._values.detach()[shifted].requires_grad_()
        self._optimizer = torch.optim.Adam([self._values], lr=self._rate)

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        """Velocities of the free components in each step [m/s, rad/s]."""
        return self._values.detach().numpy().copy()

    def learn(self, gradient: Float64[np.ndarray, "h m"]) -> None:
        """Take one step of Adam on the velocities."""
        self._values.grad = torch.tensor(gradient)
        self._optimizer.step()

    def gradient_in_nodes(
        self, gradient: Float64[np.ndarray, "h m"], nodes: Float64[np.ndarray, "h n 3"]
    ) -> Float64[np.ndarray, "h n 3"]:
        """Zero: the velocities do not depend on the nodes."""
        return np.zeros_like(nodes)


class Network:
    """Network of the paper: nodes and goal in, velocities out."""

    def __init__(self, node_count: int, component_count: int, rate: float, seed: int) -> None:
        """Create a network with random weights, distributed as in torch's linear layers.

        Args:
            node_count: Nodes of the rope.
            component_count: Free components of the grips' velocities.
            rate: Learning rate of Adam.
            seed: Seed of the initial weights.
        """
        torch.set_num_threads(1)
        nn = torch.nn
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            self.layers = nn.Sequential(
                nn.Linear(6 * node_count, HIDDEN_WIDTH),
                nn.ReLU(),
                nn.Linear(HIDDEN_WIDTH, HIDDEN_WIDTH),
                nn.ReLU(),
                nn.Linear(HIDDEN_WIDTH, component_count),
            )
        self._optimizer = torch.optim.Adam(self.layers.parameters(), lr=rate, fused=True)
        self._inputs = self._outputs = torch.empty(0)

    def begin(self, elapsed_steps: int) -> None:
        """Keep weights and moments: the paper trains them from horizon to horizon."""

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        """Velocities of the free components in each step [m/s, rad/s]."""
        self._inputs = torch.tensor(nodes, dtype=torch.float32).requires_grad_()
        goals = torch.tensor(goal, dtype=torch.float32).flatten().expand(len(nodes), -1)
        self._outputs = self.layers(torch.cat([self._inputs.flatten(1), goals], 1))
        return self._outputs.detach().double().numpy()

    def learn(self, gradient: Float64[np.ndarray, "h m"]) -> None:
        """Take one step of Adam on the weights."""
        self._optimizer.zero_grad()
        self._outputs.backward(torch.tensor(gradient, dtype=torch.float32))
        self._optimizer.step()

    def gradient_in_nodes(
        self, gradient: Float64[np.ndarray, "h m"], nodes: Float64[np.ndarray, "h n 3"]
    ) -> Float64[np.ndarray, "h n 3"]:
        """Gradient of the loss with respect to the nodes before each step, through the network."""
        seed = torch.tensor(gradient, dtype=torch.float32)
        (by_nodes,) = torch.autograd.grad(self._outputs, self._inputs, seed, retain_graph=True)
        return by_nodes.double().numpy()
