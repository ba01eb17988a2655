"""Jacobians of the residuals of arms, against differences, with two CR5s."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.planning.arms import arm_residuals
from lariat.planning.arms.arm_residuals import ArmResiduals
from lariat.planning.path_optimization.block_path import BLOCKS, BlockPath
from lariat.planning.problem import Problem
from tests.lariat.planning.arms.scenes import IN_THE_WAY, two_arms

STEP = 1e-6


def evaluated(problem: Problem, displacements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = ArmResiduals(problem).of_path(BlockPath(problem), displacements)
    return (
        np.concatenate([residual for residual, _ in found]),
        np.concatenate([jacobian for _, jacobian in found]),
    )


@pytest.mark.parametrize(
    ("constant", "value"),
    [
        ("LINK_MARGIN", arm_residuals.LINK_MARGIN),
        ("JOINT_MARGIN", 4.6),
        ("SINGULARITY_MARGIN", 0.5),
        ("LINK_MARGIN", 0.25),
    ],
    ids=["links near the post", "joints", "singularity", "the other arm"],
)
def test_jacobians_are_the_derivatives(
    constant: str, value: float, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(arm_residuals, constant, value)
    problem = two_arms(IN_THE_WAY)
    problem = replace(problem, moves=np.ones((2, 6), dtype=bool))
    random = np.random.default_rng(1)
    displacements = BlockPath(problem).translation_to_goal()
    displacements = np.concatenate([displacements, np.zeros_like(displacements)], axis=2)
    displacements = displacements + 0.01 * random.normal(size=displacements.shape)
    residual, jacobian = evaluated(problem, displacements)
    assert len(residual) > 3
    direction = random.normal(size=displacements.shape)
    after, _ = evaluated(problem, displacements + STEP * direction)
    before, _ = evaluated(problem, displacements - STEP * direction)
    slope = np.einsum("rked,ked->r", jacobian, direction)
    numeric = (after - before) / (2.0 * STEP)
    # A rotation within a block is linearized about its end.
    scale = np.max(np.abs(numeric))
    np.testing.assert_allclose(slope, numeric, atol=0.03 * scale)


def test_no_residual_where_everything_is_far():
    problem = two_arms()
    path = BlockPath(problem)
    still = np.zeros((BLOCKS, 2, 6))
    residuals = ArmResiduals(problem).of_path(path, still)
    assert sum(len(residual) for residual, _ in residuals) == 0


def test_a_way_beyond_the_reach_is_pulled_back():
    problem = two_arms()
    away = np.zeros((BLOCKS, 2, 6))
    away[:, 0, 2] = 0.3
    residual, jacobian = evaluated(problem, away)
    step = -jacobian.reshape(len(residual), -1).T @ residual
    assert step.reshape(away.shape)[:, 0, 2].sum() < 0.0


def test_a_problem_without_arms_is_refused():
    with pytest.raises(ValueError, match="no arms"):
        ArmResiduals(replace(two_arms(), arms=None))
