"""Training of a policy through the rod's gradients."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
import torch

from environments.policies.grip_policy import GripPolicy
from environments.policies.training import ShapingTask, TrainingSettings, train

SHORT = TrainingSettings(iterations=6, batch=2, goals=2, node_count=12, steps=30)


def test_gradient_of_an_episode_is_that_of_finite_differences():
    torch.manual_seed(0)
    task = ShapingTask(SHORT)
    policy = GripPolicy(0.5).double()
    for weight in policy.parameters():
        torch.nn.init.normal_(weight, std=0.1)
    goals = task.goals[[0, 2]]
    task.cost(policy, goals).backward()
    *_, bias = policy.parameters()
    assert bias.grad is not None
    direction, step = torch.randn(6, dtype=torch.float64), 1e-6
    costs = []
    for sign in (1.0, -1.0):
        with torch.no_grad():
            bias.add_(sign * step * direction)
            costs.append(float(task.cost(policy, goals)))
            bias.sub_(sign * step * direction)
    difference = (costs[0] - costs[1]) / (2.0 * step)
    assert float(bias.grad @ direction) == pytest.approx(difference, rel=1e-3)


def test_training_lowers_the_cost_of_its_goals():
    task = ShapingTask(SHORT)
    before = float(task.cost(GripPolicy(0.5).double(), task.goals).detach())
    trained = train(SHORT)
    assert float(task.cost(trained, task.goals).detach()) < before


def test_a_policy_of_zeros_goes_straight_to_the_goal_and_survives_its_file(tmp_path: Path):
    GripPolicy(0.5).double().save(tmp_path / "policy.pt")
    policy = GripPolicy.load(tmp_path / "policy.pt")
    goal = np.array([[0.1, 0.2, 0.3], [0.2, 0.2, 0.2], [0.3, 0.2, 0.3]])
    grips = np.zeros((2, 7))
    observation = {"goal": goal, "grips": grips, "velocities": np.zeros((2, 6))}
    np.testing.assert_allclose(policy.act(observation), 4.0 * goal[[0, 2]] / 0.5, rtol=1e-6)
