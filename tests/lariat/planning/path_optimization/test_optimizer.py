from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import chain_clearance
from lariat.planning.path_optimization.optimizer import PathCandidate, PathOptimizer
from lariat.planning.problem import Problem
from lariat.planning.seeds import seed_paths
from tests.lariat.planning.test_whole_path import behind_the_wall, far_behind_a_thin_wall

__all__ = ["behind_the_wall"]


@pytest.fixture(scope="module")
def optimizer(behind_the_wall: Problem) -> PathOptimizer:
    return PathOptimizer(behind_the_wall)


@pytest.fixture(scope="module")
def seeds(behind_the_wall: Problem, optimizer: PathOptimizer) -> list[PathCandidate]:
    return [optimizer.translated(seed) for seed in seed_paths(behind_the_wall)[:2]]


def test_refinement_lowers_the_cost_and_the_shortfall(
    optimizer: PathOptimizer, seeds: list[PathCandidate]
) -> None:
    straight = seeds[0]
    refined = optimizer.refine(straight, 3)
    assert refined.cost < 0.5 * straight.cost
    assert refined.shortfall < straight.shortfall


@pytest.mark.parametrize("share", [1.0, 0.8], ids=["to the goal", "short of the goal"])
def test_the_gradient_is_the_derivative_of_half_the_cost(
    optimizer: PathOptimizer, seeds: list[PathCandidate], share: float
) -> None:
    candidate = optimizer.follow(share * optimizer.refine(seeds[0], 1).displacements)
    _, gradient = optimizer._normal_equations(candidate)
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    direction = np.random.default_rng(0).normal(size=len(gradient))
    change = np.zeros_like(candidate.displacements)
    change[:, moves] = 1e-5 * direction.reshape(len(change), -1)
    ahead = optimizer.follow(candidate.displacements + change)
    behind = optimizer.follow(candidate.displacements - change)
    slope = (ahead.cost - behind.cost) / 4e-5
    assert slope == pytest.approx(float(gradient @ direction), rel=0.02)


def test_grips_of_a_candidate_lead_from_start_to_goal(
    behind_the_wall: Problem, optimizer: PathOptimizer, seeds: list[PathCandidate]
) -> None:
    positions = optimizer.grips(seeds[1]).positions
    for grips, at in ((behind_the_wall.grips, 0), (behind_the_wall.goal.grips, -1)):
        np.testing.assert_allclose(positions[at], [g.position for g in grips], atol=1e-12)


def test_a_larger_reserve_costs_more(behind_the_wall: Problem, seeds: list[PathCandidate]) -> None:
    wider = PathOptimizer(behind_the_wall, 0.02)
    assert wider.reevaluate(seeds[0]).cost > seeds[0].cost


@pytest.fixture(scope="module")
def tunnelling(behind_the_wall: Problem) -> tuple[Problem, PathOptimizer, PathCandidate]:
    # The wall stands halfway between two steps.
    problem = far_behind_a_thin_wall(behind_the_wall, -0.12 + 18.5 / 36.0 * 0.7)
    optimizer = PathOptimizer(problem, 0.0)
    return problem, optimizer, optimizer.translated(seed_paths(problem)[0])


def test_a_path_that_is_clear_at_all_steps_but_jumps_over_a_wall_is_short_of_clearance(
    tunnelling: tuple[Problem, PathOptimizer, PathCandidate],
) -> None:
    problem, _, straight = tunnelling
    clear = [chain_clearance(n, problem.radius, problem.obstacles) for n in straight.nodes]
    assert min(clear) > 0.0
    assert straight.shortfall > problem.clearance + problem.radius


def test_the_gradient_counts_what_lies_between_the_steps(
    tunnelling: tuple[Problem, PathOptimizer, PathCandidate],
) -> None:
    _, optimizer, straight = tunnelling
    _, gradient = optimizer._normal_equations(straight)
    change = np.zeros_like(straight.displacements)
    change[4, :, 1] = 1e-5
    ahead = optimizer.follow(straight.displacements + change)
    behind = optimizer.follow(straight.displacements - change)
    slope = (ahead.cost - behind.cost) / 4e-5
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    assert slope == pytest.approx(float(gradient @ (change[:, moves].ravel() / 1e-5)), rel=0.02)
