"""Policies that the paper trains in a horizon: its network, or the velocities themselves.

The network's input are the nodes of the iteration before, so that one launch rolls a horizon out
and one carries its loss back; the dependence of that input on the network's own outputs is
neglected, unless `PaperOptimizer` differentiates through it.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from jaxtyping import Float64

if TYPE_CHECKING:
    import torch

ACTIONS_RATE = 0.03
"""Learning rate of Adam on the velocities [m/s], tuned; the paper does not state its own."""
HIDDEN_WIDTH = 256
"""Width of both hidden layers."""
FIRST_MOMENT_DECAY = 0.9
"""Decay of Adam's mean gradient per step [-], Adam's own default."""
SECOND_MOMENT_DECAY = 0.999
"""Decay of Adam's mean squared gradient per step [-], Adam's own default."""
MIN_DENOMINATOR = 1e-8
"""Number that Adam adds to the root of the mean squared gradient, Adam's own default."""


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


class Adam:
    """Adam on an array, without a learning rate schedule."""

    def __init__(self, shape: tuple[int, ...], rate: float) -> None:
        """Create an optimizer without history.

        Args:
            shape: Shape of the array.
            rate: Learning rate, in the unit of the array.
        """
        self.rate = rate
        self._first_moment, self._second_moment = np.zeros(shape), np.zeros(shape)
        self._steps = 0

    def step(self, gradient: Float64[np.ndarray, "*shape"]) -> Float64[np.ndarray, "*shape"]:
        """Change to add to the array.

        Args:
            gradient: Gradient of the loss with respect to the array.
        """
        self._steps += 1
        a, b = FIRST_MOMENT_DECAY, SECOND_MOMENT_DECAY
        self._first_moment = a * self._first_moment + (1.0 - a) * gradient
        self._second_moment = b * self._second_moment + (1.0 - b) * gradient**2
        mean = self._first_moment / (1.0 - a**self._steps)
        spread = np.sqrt(self._second_moment / (1.0 - b**self._steps))
        return -self.rate * mean / (spread + MIN_DENOMINATOR)


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
        self._values = np.zeros((step_count, component_count))
        self.begin(0)

    def begin(self, elapsed_steps: int) -> None:
        """Shift the velocities in time and restart Adam.

        Args:
            elapsed_steps: Steps since the beginning of the last horizon.
        """
        last = len(self._values) - 1
        shifted = np.minimum(np.arange(len(self._values)) + elapsed_steps, last)
        self._values = self._values[shifted]
        self._adam = Adam(self._values.shape, self._rate)

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        """Velocities of the free components in each step [m/s, rad/s]."""
        return self._values

    def learn(self, gradient: Float64[np.ndarray, "h m"]) -> None:
        """Take one step of Adam on the velocities."""
        self._values = self._values + self._adam.step(gradient)

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
        import torch

        torch.set_num_threads(1)
        generator = torch.Generator().manual_seed(seed)
        sizes = (6 * node_count, HIDDEN_WIDTH, HIDDEN_WIDTH, component_count)
        self._torch: Any = torch
        shapes, values = [], []
        for inputs, outputs in pairwise(sizes):
            bound = inputs**-0.5
            for shape in ((outputs, inputs), (outputs,)):
                uniform = torch.rand(shape, generator=generator)
                values.append(((2.0 * uniform - 1.0) * bound).ravel())
                shapes.append(shape)
        # All weights are one tensor, because the time of a step of Adam grows with their number.
        self._weights: torch.Tensor = torch.cat(values).requires_grad_()
        self._weights.grad = torch.zeros_like(self._weights)
        sections = self._weights.detach().split([len(v) for v in values])
        gradients = self._weights.grad.split([len(v) for v in values])
        self.layers = [v.view(s) for v, s in zip(sections, shapes, strict=True)]
        """Weights (outputs, inputs) and biases (outputs,) of one layer after the other."""
        self._gradients = [v.view(s) for v, s in zip(gradients, shapes, strict=True)]
        self._optimizer = torch.optim.Adam([self._weights], lr=rate, fused=True)
        self._inputs: list[torch.Tensor] = []

    def begin(self, elapsed_steps: int) -> None:
        """Keep weights and moments: the paper trains them from horizon to horizon."""

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        """Velocities of the free components in each step [m/s, rad/s].

        Args:
            nodes: Nodes before each step [m].
            goal: Nodes of the goal [m].
        """
        torch = self._torch
        node_inputs = nodes.reshape(len(nodes), -1)
        goal_inputs = np.broadcast_to(goal.ravel(), node_inputs.shape)
        values = torch.from_numpy(np.concatenate([node_inputs, goal_inputs], axis=1)).float()
        self._inputs = []
        for k in range(0, len(self.layers), 2):
            self._inputs.append(values)
            values = torch.addmm(self.layers[k + 1], values, self.layers[k].T)
            if k < len(self.layers) - 2:
                values = torch.relu(values)
        return values.double().numpy()

    def learn(self, gradient: Float64[np.ndarray, "h m"]) -> None:
        """Take one step of Adam on the weights, by back-propagation.

        Args:
            gradient: Gradient of the loss with respect to the velocities returned last.
        """
        torch = self._torch
        d_outputs = torch.from_numpy(np.ascontiguousarray(gradient)).float()
        for k in range(len(self.layers) - 2, -1, -2):
            inputs = self._inputs[k // 2]
            torch.mm(d_outputs.T, inputs, out=self._gradients[k])
            torch.sum(d_outputs, 0, out=self._gradients[k + 1])
            if k:
                d_outputs = (d_outputs @ self.layers[k]) * (inputs > 0.0)
        self._optimizer.step()

    def gradient_in_nodes(
        self, gradient: Float64[np.ndarray, "h m"], nodes: Float64[np.ndarray, "h n 3"]
    ) -> Float64[np.ndarray, "h n 3"]:
        """Gradient of the loss with respect to the nodes before each step, through the network.

        Args:
            gradient: Gradient of the loss with respect to the velocities returned last.
            nodes: Nodes for which these velocities were returned [m].
        """
        torch = self._torch
        d_values = torch.from_numpy(np.ascontiguousarray(gradient)).float()
        for k in range(len(self.layers) - 2, -1, -2):
            d_values = d_values @ self.layers[k]
            if k:
                d_values = d_values * (self._inputs[k // 2] > 0.0)
        # The second half of the inputs is the goal.
        return d_values[:, : nodes[0].size].double().numpy().reshape(nodes.shape)
