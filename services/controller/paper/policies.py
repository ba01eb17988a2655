"""Policies that the paper trains in a horizon: its network, or the velocities themselves.

The network sees the nodes of the iteration before, so that one launch rolls a horizon out and one
carries its loss back; its outputs count as independent of how they moved its own inputs. Over 50 ms
those nodes hardly differ from the present ones.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from jaxtyping import Float64

if TYPE_CHECKING:
    import torch

ACTIONS_RATE = 0.03
"""Learning rate of Adam on the velocities, tuned; the paper does not state its own."""
HIDDEN_WIDTH = 256
"""Width of both hidden layers."""
BETAS, EPSILON = (0.9, 0.999), 1e-8
"""Adam's own defaults."""


class Policy(Protocol):
    """Trainable map from nodes and goal to velocities."""

    def begin(self, passed: int) -> None:
        """Begin a horizon, some steps after the last one."""
        ...

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        """Velocities of the free components at each step, from the nodes before it [m/s, rad/s]."""
        ...

    def learn(self, slope: Float64[np.ndarray, "h m"]) -> None:
        """Take one step of Adam, given the gradient of the loss."""
        ...


class Adam:
    """Adam on an array."""

    def __init__(self, shape: tuple[int, ...], rate: float) -> None:
        self.rate = rate
        self._first, self._second = np.zeros(shape), np.zeros(shape)
        self._steps = 0

    def step(self, slope: Float64[np.ndarray, "*shape"]) -> Float64[np.ndarray, "*shape"]:
        """Change to add to the array."""
        self._steps += 1
        a, b = BETAS
        self._first = a * self._first + (1.0 - a) * slope
        self._second = b * self._second + (1.0 - b) * slope**2
        mean = self._first / (1.0 - a**self._steps)
        spread = np.sqrt(self._second / (1.0 - b**self._steps))
        return -self.rate * mean / (spread + EPSILON)


class Actions:
    """Adam on the velocities themselves."""

    def __init__(self, horizon: int, count: int, rate: float = ACTIONS_RATE) -> None:
        """
        Args:
            horizon: Steps.
            count: Free components.
            rate: Learning rate of Adam.
        """
        self._rate = rate
        self._values = np.zeros((horizon, count))
        self.begin(0)

    def begin(self, passed: int) -> None:
        later = np.minimum(np.arange(len(self._values)) + passed, len(self._values) - 1)
        self._values = self._values[later]
        self._adam = Adam(self._values.shape, self._rate)

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        return self._values

    def learn(self, slope: Float64[np.ndarray, "h m"]) -> None:
        self._values = self._values + self._adam.step(slope)


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
        sizes = (6 * nodes, HIDDEN_WIDTH, HIDDEN_WIDTH, count)
        self._torch: Any = torch
        shapes, values = [], []
        for inputs, outputs in pairwise(sizes):
            # As torch's own linear layers begin.
            bound = inputs**-0.5
            for shape in ((outputs, inputs), (outputs,)):
                first = torch.rand(shape, generator=generator)
                values.append(((2.0 * first - 1.0) * bound).ravel())
                shapes.append(shape)
        # One tensor: Adam costs by the tensor.
        self._weights: torch.Tensor = torch.cat(values).requires_grad_()
        self._weights.grad = torch.zeros_like(self._weights)
        sections = self._weights.detach().split([len(v) for v in values])
        slopes = self._weights.grad.split([len(v) for v in values])
        self.layers = [v.view(s) for v, s in zip(sections, shapes, strict=True)]
        """ObjectiveWeights (outputs, inputs) and biases of one layer after the other."""
        self._slopes = [v.view(s) for v, s in zip(slopes, shapes, strict=True)]
        self._optimiser = torch.optim.Adam([self._weights], lr=rate, fused=True)
        self._inputs: list[torch.Tensor] = []

    def begin(self, passed: int) -> None:
        """ObjectiveWeights are kept."""

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        torch = self._torch
        seen = nodes.reshape(len(nodes), -1)
        wanted = np.broadcast_to(goal.ravel(), seen.shape)
        values = torch.from_numpy(np.concatenate([seen, wanted], axis=1)).float()
        self._inputs = []
        for k in range(0, len(self.layers), 2):
            self._inputs.append(values)
            values = torch.addmm(self.layers[k + 1], values, self.layers[k].T)
            if k < len(self.layers) - 2:
                values = torch.relu(values)
        return values.double().numpy()

    def learn(self, slope: Float64[np.ndarray, "h m"]) -> None:
        torch = self._torch
        pull = torch.from_numpy(np.ascontiguousarray(slope)).float()
        for k in range(len(self.layers) - 2, -1, -2):
            inputs = self._inputs[k // 2]
            torch.mm(pull.T, inputs, out=self._slopes[k])
            torch.sum(pull, 0, out=self._slopes[k + 1])
            if k:
                pull = (pull @ self.layers[k]) * (inputs > 0.0)
        self._optimiser.step()
