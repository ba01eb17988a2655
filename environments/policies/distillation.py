"""Distillation of the planner: a `GripPolicy` that imitates planned paths of the grips.

Every seeded goal is planned once. The network then learns the velocity along the paths, and beside
them the way back: the grips of a sample are displaced, and the wanted velocity is that of the path
plus a part that removes the displacement. Without the displaced samples a policy drifts off its
paths into states that no path has shown it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Float64

from environments.policies.grip_policy import GripPolicy
from environments.scenes import Kind, sample_scene
from lariat.geometry import Pose
from lariat.planning.problem import Problem
from lariat.planning.whole_path import plan
from lariat.rod import Rod
from lariat.scenario import Scenario, load
from lariat.scenario.rod_properties import rod_properties


@dataclass(frozen=True)
class DistillationSettings:
    """Settings of a distillation."""

    scenes: tuple[Kind, ...] = ("easy", "hard")
    """Kinds of the scenes that the goals are taken from: those among the three cylinders."""
    goals: int = 128
    """Number of planned goals of each kind."""
    seed: int = 1000
    """Seed of the goals and of the draws."""
    node_count: int = 20
    """Number of nodes of the rod in the plan."""
    clearance: float = 0.025
    """Clearance that is wanted of the paths [m]; the scenario's own suffices."""
    period: float = 0.05
    """Duration of a step of the policy [s]."""
    width: int = 128
    """Number of units of each hidden layer."""
    iterations: int = 6000
    """Number of steps of the optimiser."""
    batch: int = 1024
    """Number of samples of each step."""
    learning_rate: float = 2e-3
    """Learning rate of Adam at the first step; it falls to a hundredth along a cosine."""
    displacement: float = 0.03
    """Largest standard deviation of the displacements [m]."""
    return_rate: float = 3.0
    """Part of a displacement that is removed in a second [1/s]."""


@dataclass(frozen=True)
class Demonstration:
    """Planned motion of both grips to one goal."""

    goal: Float64[np.ndarray, "3 3"]
    """First, middle and last node of the goal [m]."""
    grips: Float64[np.ndarray, "t 2 3"]
    """Positions of both grips at each step of the policy [m]."""
    velocities: Float64[np.ndarray, "t 2 3"]
    """Mean velocities of both grips in the following step [m/s]."""


def train(
    settings: DistillationSettings,
    report: Callable[[float], None] = lambda share: None,
) -> GripPolicy:
    """Return a policy that imitates the planner.

    Args:
        settings: Settings.
        report: Callback that takes the share of the work that is done.
    """
    found = demonstrations(settings, lambda share: report(0.5 * share))
    return imitated(found, settings, lambda share: report(0.5 + 0.5 * share))


def demonstrations(
    settings: DistillationSettings, report: Callable[[float], None] = lambda share: None
) -> list[Demonstration]:
    """Return the planned motions to all goals that the planner reaches.

    Args:
        settings: Settings.
        report: Callback that takes the share of the goals that are planned.
    """
    base = load("three-cylinders")
    base = replace(
        base,
        rope=replace(base.rope, node_count=settings.node_count),
        plant=replace(
            base.plant,
            model="rod",
            rope=replace(base.plant.rope, node_count=settings.node_count),
        ),
    )
    rod = Rod(rod_properties(base.rope), settings.node_count)
    found = []
    cases = [(kind, number) for kind in settings.scenes for number in range(settings.goals)]
    with tempfile.TemporaryDirectory() as folder:
        for k, (kind, number) in enumerate(cases):
            scene = sample_scene(kind, number, settings.seed, base, Path(folder))
            motion = _planned(scene, rod, settings)
            found += [motion] if motion is not None else []
            report((k + 1) / len(cases))
    return found


def _planned(scene: Scenario, rod: Rod, settings: DistillationSettings) -> Demonstration | None:
    """Planned motion to the goal of a scene; None where the planner does not reach it."""
    goal = scene.nodes(scene.goal)
    assert goal is not None
    grips = scene.grips(scene.start)
    left, right = (Pose(goal[k], grip.orientation) for k, grip in zip((0, -1), grips, strict=True))
    path = plan(
        Problem(
            rod=rod,
            state=rod.rest(*grips).state,
            grips=grips,
            goal=goal,
            goal_grips=(left, right),
            moves=np.array([[True] * 3 + [False] * 3] * 2),  # The grips move and do not rotate.
            obstacles=scene.bodies,
            supports=(),
            limits=scene.limits,
            clearance=settings.clearance,
            tolerance=scene.run.tolerance,
            spare_clearance=max(settings.clearance - scene.control.clearance, 0.0),
        )
    )
    if not path.reached:
        return None
    duration = path.dt * (len(path.positions) - 1)
    times = np.arange(0.0, duration + settings.period, settings.period)
    known = path.dt * np.arange(len(path.positions))
    columns = path.positions.reshape(-1, 6).T
    positions = np.array([np.interp(times, known, c) for c in columns]).T.reshape(-1, 2, 3)
    # At the end of the path the grips rest.
    velocities = np.diff(positions, axis=0, append=positions[-1:]) / settings.period
    return Demonstration(goal[[0, len(goal) // 2, -1]], positions, velocities)


def imitated(
    motions: Sequence[Demonstration],
    settings: DistillationSettings,
    report: Callable[[float], None] = lambda share: None,
) -> GripPolicy:
    """Return a policy that imitates motions.

    Args:
        motions: Planned motions.
        settings: Settings.
        report: Callback that takes the share of the steps that are done.
    """
    torch.manual_seed(settings.seed)
    grips = torch.as_tensor(np.concatenate([m.grips for m in motions]))
    velocities = torch.as_tensor(np.concatenate([m.velocities for m in motions]))
    goals = torch.as_tensor(
        np.concatenate([np.broadcast_to(m.goal, (len(m.grips), 3, 3)) for m in motions])
    )
    policy = GripPolicy(load("three-cylinders").limits.speed, settings.width).double()
    policy.ignore_velocities()
    optimizer = torch.optim.Adam(policy.parameters(), settings.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
        optimizer, settings.iterations, settings.learning_rate / 100.0
    )
    for step in range(settings.iterations):
        drawn = torch.randint(len(grips), (settings.batch,))
        moved = _displacements(settings.batch, settings.displacement)
        wanted = velocities[drawn] - settings.return_rate * moved
        answer = policy(grips[drawn] + moved, torch.zeros_like(moved), goals[drawn])
        optimizer.zero_grad()
        (answer - wanted).square().sum(2).mean().backward()
        optimizer.step()
        schedule.step()
        report((step + 1) / settings.iterations)
    return policy


def _displacements(count: int, deviation: float) -> Float[torch.Tensor, "b 2 3"]:
    """Displacements of both grips, in part the same for both, of sizes from 0 on [m]."""
    scale = deviation * torch.rand(count, 1, 1).double()
    alone, together = torch.randn(count, 2, 3).double(), torch.randn(count, 1, 3).double()
    return scale * (0.5 * alone + 0.7 * together)
