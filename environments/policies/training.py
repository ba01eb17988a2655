"""Training of a `GripPolicy` through the rod's gradients.

The policy sees the grips and not the rope, so that a whole episode of velocities follows from the
kinematics of the grips alone. One batch of roll-outs turns them into the motion of the ropes, and
one adjoint launch turns the gradient of the cost in their nodes into that in the velocities. The
gradient of the cost in the weights is exact.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float

from environments.policies.grip_policy import GripPolicy
from environments.scenes import Kind, sample_scene
from lariat.geometry.obstacles import Obstacle
from lariat.rod import Rod, RolloutSpec
from lariat.rod.torch import rollout
from lariat.scenario import Scenario, load
from lariat.scenario.rod_properties import rod_properties


@dataclass(frozen=True)
class TrainingSettings:
    """Settings of a training."""

    iterations: int = 400
    """Number of steps of the optimiser."""
    batch: int = 16
    """Number of episodes of each step."""
    scenes: tuple[Kind, ...] = ("easy", "hard")
    """Kinds of the scenes that the goals are taken from: those among the three cylinders."""
    goals: int = 128
    """Number of goals of each kind, from which episodes draw."""
    seed: int = 1000
    """Seed of the goals and of the draws."""
    node_count: int = 20
    """Number of nodes of the rods."""
    period: float = 0.05
    """Duration of a step of the policy [s]."""
    steps: int = 80
    """Number of steps of an episode."""
    learning_rate: float = 3e-3
    """Learning rate of Adam at the first step; it falls to a tenth along a cosine."""
    clearance: float = 0.015
    """Clearance below which rope and grips cost [m]."""
    clearance_weight: float = 20.0
    """Weight of the missing clearance, relative to the distance to the goal [-]."""


class ShapingTask:
    """Seeded goals, the rod, and the cost of a batch of episodes."""

    def __init__(self, settings: TrainingSettings) -> None:
        """Sample the goals.

        Args:
            settings: Settings of the training.
        """
        self.settings = settings
        base = load("three-cylinders")
        count = settings.node_count
        self.scenario = base = replace(
            base,
            rope=replace(base.rope, node_count=count),
            plant=replace(base.plant, model="rod", rope=replace(base.plant.rope, node_count=count)),
        )
        self.rod = Rod(rod_properties(base.rope), count)
        self.start = self.rod.rest(*base.grips(base.start)).state
        with tempfile.TemporaryDirectory() as folder:
            self.goals = torch.as_tensor(
                np.stack(
                    [
                        _goal(base, kind, number, settings.seed, folder)
                        for kind in settings.scenes
                        for number in range(settings.goals)
                    ]
                )
            )

    def cost(
        self, policy: GripPolicy, goals: Float[torch.Tensor, "b n 3"]
    ) -> Float[torch.Tensor, ""]:
        """Return the mean cost of episodes, differentiable in the weights of the policy [m].

        Args:
            policy: Policy with weights in double precision.
            goals: Nodes of the goal of each episode [m].
        """
        settings, limits = self.settings, self.scenario.limits
        dt, batch = settings.period, len(goals)
        start = torch.as_tensor(self.start.positions[[0, -1]])
        grips, velocities = start.expand(batch, 2, 3), torch.zeros(batch, 2, 3).double()
        targets = goals[:, [0, goals.shape[1] // 2, -1]]
        means, ends = [], []
        for _ in range(settings.steps):
            wanted = _clipped(policy(grips, velocities, targets), limits.speed)
            changed = velocities + _clipped(wanted - velocities, dt * limits.acceleration)
            means.append(0.5 * (velocities + changed))
            grips, velocities = grips + dt * means[-1], changed
            ends.append(grips)
        actions = torch.stack(means, 1)
        actions = torch.cat([actions, torch.zeros_like(actions)], 3)
        nodes = rollout(
            self.rod, RolloutSpec([self.start] * batch, actions.detach().numpy(), dt), actions
        )
        error = (nodes - goals[:, None]).norm(dim=3).mean((0, 2))
        # The end of an episode counts as much as the way to it.
        reaching = error.mean() + 2.0 * error[-settings.steps // 4 :].mean()
        points = torch.cat([nodes, torch.stack(ends, 1)], 2)
        # A node between two others is nearer than they are by the sag of an edge, which is small.
        radius = self.scenario.rope.diameter / 2.0
        lack = torch.relu(settings.clearance + radius - self._distance(points))
        return reaching + settings.clearance_weight * lack.mean((0, 1)).sum() / points.shape[2]

    def _distance(self, points: Float[torch.Tensor, "*a 3"]) -> Float[torch.Tensor, "*a"]:
        """Distance to the nearest cylinder or to the table [m]."""
        distances = [points[..., 2]]
        for body in self.scenario.bodies:
            if body.shape == "cylinder":
                distances.append(_cylinder_distance(points, body))
        return torch.stack(distances).amin(0)


def train(
    settings: TrainingSettings, report: Callable[[int, float], None] = lambda step, cost: None
) -> GripPolicy:
    """Return a trained policy.

    Args:
        settings: Settings of the training.
        report: Callback that takes the number of the step and its cost [m].
    """
    torch.manual_seed(settings.seed)
    task = ShapingTask(settings)
    policy = GripPolicy(task.scenario.limits.speed).double()
    optimizer = torch.optim.Adam(policy.parameters(), settings.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
        optimizer, settings.iterations, settings.learning_rate / 10.0
    )
    for step in range(settings.iterations):
        drawn = torch.randint(len(task.goals), (settings.batch,))
        optimizer.zero_grad()
        cost = task.cost(policy, task.goals[drawn])
        cost.backward()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        optimizer.step()
        schedule.step()
        report(step, float(cost.detach()))
    return policy


def _goal(base: Scenario, kind: Kind, number: int, seed: int, folder: str) -> np.ndarray:
    scene = sample_scene(kind, number, seed, base, Path(folder))
    goal = scene.nodes(scene.goal)
    assert goal is not None
    return goal


def _clipped(vectors: Float[torch.Tensor, "*b 3"], bound: float) -> Float[torch.Tensor, "*b 3"]:
    length = (vectors.square().sum(-1, keepdim=True) + 1e-18).sqrt()
    return vectors * torch.clamp(bound / length, max=1.0)


def _cylinder_distance(
    points: Float[torch.Tensor, "*a 3"], body: Obstacle
) -> Float[torch.Tensor, "*a"]:
    """Signed distance to an upright cylinder [m]."""
    centre = torch.tensor(body.position, dtype=points.dtype)
    away = points - centre
    side = (away[..., :2].square().sum(-1) + 1e-18).sqrt() - body.radius
    top = away[..., 2].abs() - body.height / 2.0
    outside = (torch.relu(side).square() + torch.relu(top).square() + 1e-18).sqrt()
    return outside + torch.clamp(torch.maximum(side, top), max=0.0)
