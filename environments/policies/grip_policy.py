"""Policy that maps grips and goal to grip velocities: a law towards the goal, bent by a network."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Float32
from torch import nn

WIDTH = 64
"""Default number of units of each hidden layer."""
GAIN = 4.0
"""Gain of the law towards the goal [1/s]."""
VANISHING_DISTANCE = 0.05
"""Distance to the goal at which the network's part has half of its size [m]."""
LENGTH_SCALE = 0.2
"""Length that scales the network's inputs to order one [m]."""


class GripPolicy(nn.Module):
    """Velocities of both grips from the grips and the goal, without rotation.

    The velocity is `GAIN` times the way of each grip to its end of the goal, plus a network's
    output that vanishes at the goal. With a network of zeros the grips go straight to the goal. The
    rope's nodes are no input: they enter the training through its cost.
    """

    def __init__(self, speed: float, width: int = WIDTH) -> None:
        """Create a policy whose network is zero.

        Args:
            speed: Limit of each grip's speed, which scales actions [m/s].
            width: Number of units of each hidden layer.
        """
        super().__init__()
        self.speed, self.width = speed, width
        self.network = nn.Sequential(
            nn.Linear(21, width), nn.Tanh(), nn.Linear(width, width), nn.Tanh(), nn.Linear(width, 6)
        )
        nn.init.zeros_(self.network[-1].weight)
        nn.init.zeros_(self.network[-1].bias)

    def forward(
        self,
        grips: Float[torch.Tensor, "b 2 3"],
        velocities: Float[torch.Tensor, "b 2 3"],
        goal: Float[torch.Tensor, "b 3 3"],
    ) -> Float[torch.Tensor, "b 2 3"]:
        """Return the commanded velocities [m/s].

        Args:
            grips: Positions of both grips [m].
            velocities: Velocities of both grips [m/s].
            goal: First, middle and last node of the goal [m].
        """
        way = goal[:, [0, 2]] - grips
        inputs = torch.cat([way, grips, goal[:, 1:2]], 1) / LENGTH_SCALE
        features = torch.cat([inputs.flatten(1), velocities.flatten(1) / self.speed], 1)
        bend = self.network(features).reshape(-1, 2, 3)
        far = way.norm(dim=2).mean(1)[:, None, None]
        return GAIN * way + self.speed * bend * far / (far + VANISHING_DISTANCE)

    def ignore_velocities(self) -> None:
        """Remove the weights of the velocities, which stay zero where the velocities are zero."""
        with torch.no_grad():
            self.network[0].weight[:, -6:] = 0.0

    def act(self, observation: dict[str, np.ndarray]) -> Float32[np.ndarray, "2 3"]:
        """Return the action for an observation of `ShapeControl`."""
        goal = observation["goal"]
        inputs = (
            observation["grips"][:, :3],
            observation["velocities"][:, :3],
            goal[[0, len(goal) // 2, -1]],
        )
        with torch.no_grad():
            command = self(*(torch.as_tensor(i, dtype=torch.float64)[None] for i in inputs))[0]
        return (command / self.speed).numpy().astype(np.float32)

    def save(self, file: Path) -> None:
        """Write the weights."""
        kept = {"speed": self.speed, "width": self.width, "weights": self.state_dict()}
        torch.save(kept, file)

    @staticmethod
    def load(file: Path) -> GripPolicy:
        """Return the policy that `save` wrote."""
        saved = torch.load(file, weights_only=True)
        policy = GripPolicy(saved["speed"], saved["width"]).double()
        policy.load_state_dict(saved["weights"])
        return policy
