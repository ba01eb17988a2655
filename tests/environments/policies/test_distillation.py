"""Policies that imitate the planner."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
import torch

from environments.policies.distillation import (
    Demonstration,
    DistillationSettings,
    demonstrations,
    imitated,
)
from environments.policies.grip_policy import GripPolicy
from lariat.scenario import load

SHORT = DistillationSettings(goals=1, node_count=12, width=32, iterations=300, batch=256)


@pytest.fixture(scope="module")
def motions() -> list[Demonstration]:
    return demonstrations(SHORT)


def observation(grips: np.ndarray, goal: np.ndarray) -> dict[str, np.ndarray]:
    held = np.hstack([grips, np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))])
    return {"goal": goal, "grips": held, "velocities": np.zeros((2, 6))}


def deviation(policy: GripPolicy, motions: list[Demonstration], aside: np.ndarray) -> float:
    """Root mean square distance of commanded from wanted velocities [m/s]."""
    errors = []
    for motion in motions:
        for grips, velocity in zip(motion.grips, motion.velocities, strict=True):
            wanted = velocity - SHORT.return_rate * aside
            answer = policy.speed * policy.act(observation(grips + aside, motion.goal))
            errors.append(np.square(answer - wanted).sum(axis=1).mean())
    return float(np.sqrt(np.mean(errors)))


def test_a_demonstration_leads_from_the_start_to_the_goal_at_rest(motions: list[Demonstration]):
    scenario = load("three-cylinders")
    start = np.array([grip.position for grip in scenario.grips(scenario.start)])
    assert len(motions) == 2
    for motion in motions:
        np.testing.assert_allclose(motion.grips[0], start, atol=1e-9)
        np.testing.assert_allclose(motion.grips[-1], motion.goal[[0, 2]], atol=5e-3)
        assert np.all(motion.velocities[-1] == 0.0)
        travelled = motion.grips[0] + SHORT.period * motion.velocities.sum(axis=0)
        np.testing.assert_allclose(travelled, motion.grips[-1], atol=1e-9)
        speeds = np.linalg.norm(motion.velocities, axis=2)
        assert 0.1 < speeds.max() <= scenario.limits.speed


@pytest.mark.parametrize("aside", [0.0, 0.02], ids=["on the path", "beside it"])
def test_a_policy_follows_its_demonstrations(motions: list[Demonstration], aside: float):
    policy = imitated(motions, SHORT)
    straight = GripPolicy(policy.speed).double()
    displaced = np.full((2, 3), aside / np.sqrt(3.0))
    found, otherwise = (deviation(p, motions, displaced) for p in (policy, straight))
    assert found < 0.5 * otherwise


def test_a_policy_rests_at_the_goal_and_heeds_no_velocities(motions: list[Demonstration]):
    policy = imitated(motions, replace(SHORT, iterations=20))
    goal = motions[0].goal
    at_goal = observation(goal[[0, 2]], goal)
    assert policy.act(at_goal) == pytest.approx(np.zeros((2, 3)), abs=1e-12)
    moving = {**at_goal, "velocities": np.ones((2, 6))}
    near = {"grips": at_goal["grips"] + 0.01}
    assert np.array_equal(policy.act(moving | near), policy.act(at_goal | near))


def test_a_wide_policy_survives_its_file(tmp_path: Path):
    torch.manual_seed(0)
    policy = GripPolicy(0.5, width=24).double()
    torch.nn.init.normal_(policy.network[-1].weight)
    policy.save(tmp_path / "policy.pt")
    goal = np.array([[0.1, 0.2, 0.3], [0.2, 0.2, 0.2], [0.3, 0.2, 0.3]])
    seen = observation(np.zeros((2, 3)), goal)
    assert np.array_equal(GripPolicy.load(tmp_path / "policy.pt").act(seen), policy.act(seen))
