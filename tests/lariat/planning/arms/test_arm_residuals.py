"""Jacobians of the residuals of arms, against differences, with two CR5s."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.planning.arms.arm_residuals import (
    ARM_RESIDUAL_SETTINGS,
    ArmResiduals,
    ArmResidualSettings,
)
from lariat.planning.path_optimization.block_path import BlockPath
from lariat.planning.path_optimization.settings import PathOptimizationSettings
from lariat.planning.problem import Problem
from tests.lariat.planning.arms.scenes import IN_THE_WAY, two_arms

PATH = PathOptimizationSettings(blocks=3)
STEP = 1e-6


def evaluated(
    problem: Problem, displacements: np.ndarray, settings: ArmResidualSettings
) -> tuple[np.ndarray, np.ndarray]:
    found = ArmResiduals(problem, settings).of_path(BlockPath(problem, PATH), displacements)
    return (
        np.concatenate([residual for residual, _ in found]),
        np.concatenate([jacobian for _, jacobian in found]),
    )


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        (ARM_RESIDUAL_SETTINGS, "links near the post"),
        (replace(ARM_RESIDUAL_SETTINGS, joint_margin=4.6), "joints"),
        (replace(ARM_RESIDUAL_SETTINGS, singularity_margin=0.5), "singularity"),
        (replace(ARM_RESIDUAL_SETTINGS, link_margin=0.25), "the other arm"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_jacobians_are_the_derivatives(settings: ArmResidualSettings, name: str):
    problem = two_arms(IN_THE_WAY)
    problem = replace(problem, moves=np.ones((2, 6), dtype=bool))
    random = np.random.default_rng(1)
    displacements = BlockPath(problem, PATH).translation_to_goal()
    displacements = np.concatenate([displacements, np.zeros_like(displacements)], axis=2)
    displacements = displacements + 0.01 * random.normal(size=displacements.shape)
    residual, jacobian = evaluated(problem, displacements, settings)
    assert len(residual) > 3
    direction = random.normal(size=displacements.shape)
    after, _ = evaluated(problem, displacements + STEP * direction, settings)
    before, _ = evaluated(problem, displacements - STEP * direction, settings)
    slope = np.einsum("rked,ked->r", jacobian, direction)
    numeric = (after - before) / (2.0 * STEP)
    # A rotation within a block is linearized about its end.
    scale = np.max(np.abs(numeric))
    np.testing.assert_allclose(slope, numeric, atol=0.03 * scale)


def test_no_residual_where_everything_is_far():
    problem = two_arms()
    path = BlockPath(problem, PATH)
    still = np.zeros((PATH.blocks, 2, 6))
    residuals = ArmResiduals(problem).of_path(path, still)
    assert sum(len(residual) for residual, _ in residuals) == 0


def test_a_way_beyond_the_reach_is_pulled_back():
    problem = two_arms()
    away = np.zeros((PATH.blocks, 2, 6))
    away[:, 0, 2] = 0.3
    residual, jacobian = evaluated(problem, away, ARM_RESIDUAL_SETTINGS)
    step = -jacobian.reshape(len(residual), -1).T @ residual
    assert step.reshape(away.shape)[:, 0, 2].sum() < 0.0


def test_a_problem_without_arms_is_refused():
    with pytest.raises(ValueError, match="no arms"):
        ArmResiduals(replace(two_arms(), arms=None))
