"""Policy of both grips, and its cost through the rod's roll-outs."""

from __future__ import annotations

import torch

from lariat.rod import Rod, RodState, RolloutSpec
from lariat.rod.torch import rollout

PERIOD, STEPS = 0.05, 60
"""Duration of a step [s], and steps of an episode."""
SPEED = 0.5
"""Bound of each component of a grip's velocity [m/s]."""


class Policy(torch.nn.Module):
    """Velocities of both grips: towards their ends of the goal, bent by a small network."""

    def __init__(self) -> None:
        super().__init__()
        nn = torch.nn
        self.network = nn.Sequential(nn.Linear(15, 64), nn.Tanh(), nn.Linear(64, 6)).double()
        for weights in self.network[-1].parameters():
            nn.init.zeros_(weights)

    def forward(self, grips: torch.Tensor, goals: torch.Tensor) -> torch.Tensor:
        """Return velocities (b, 2, 3) [m/s] for grips (b, 2, 3) and goals (b, n, 3) [m]."""
        way = goals[:, [0, -1]] - grips
        middle = goals[:, goals.shape[1] // 2, None]
        bend = self.network(5.0 * torch.cat([way, grips, middle], 1).flatten(1)).view_as(way)
        return (4.0 * way + 10.0 * bend * way.norm(dim=2, keepdim=True)).clamp(-SPEED, SPEED)


def cost(policy: Policy, rod: Rod, start: RodState, goals: torch.Tensor) -> torch.Tensor:
    """Return the mean distance of ropes from goals (b, n, 3) over an episode [m]."""
    grips = torch.as_tensor(start.positions[[0, -1]]).expand(len(goals), 2, 3)
    velocities = []
    for _ in range(STEPS):
        velocities.append(policy(grips, goals))
        grips = grips + PERIOD * velocities[-1]
    actions = torch.nn.functional.pad(torch.stack(velocities, 1), (0, 3))  # No rotation.
    spec = RolloutSpec([start] * len(goals), actions.detach().numpy(), PERIOD)
    return (rollout(rod, spec, actions) - goals[:, None]).norm(dim=3).mean()
