"""Newton's method of a step: number of iterations, and distance from the solution."""

from __future__ import annotations

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry.obstacles import TABLE, Obstacle, pack
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec

PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6)
ASIDE = pack([Obstacle("cylinder", (0.0, 0.15, 0.1), radius=0.03, height=0.2), TABLE])
BELOW = pack([Obstacle("sphere", (0.0, 0.0, 0.25), radius=0.03), TABLE])
ACTIONS = np.zeros((10, 2, 6))
ACTIONS[:, 0] = [0.1, 0.1, 0.0, 0.0, 1.0, 0.0]
ACTIONS[:, 1] = [-0.3, 0.1, 0.1, 1.0, 0.0, 1.0]


def moving_state(rod: Rod, obstacles: Float64[np.ndarray, "m 13"]) -> RodState:
    start = rod.straight([-0.225, 0.0, 0.3], [0.225, 0.0, 0.3])
    return rod.rollout(RolloutSpec(start, ACTIONS, 0.01, obstacles=obstacles)).final


@pytest.mark.parametrize("node_count", [20, 40, 160])
def test_a_step_beside_obstacles_takes_few_factorizations_at_any_number_of_nodes(
    node_count: int,
) -> None:
    rod = Rod(PROPERTIES, node_count)
    spec = RolloutSpec(moving_state(rod, ASIDE), ACTIONS[:5], 0.01, obstacles=ASIDE)
    assert rod.rollout(spec).iterations.mean() <= 4.0


@pytest.mark.parametrize("obstacles", [ASIDE, BELOW])
def test_solves_stop_within_the_tolerance(obstacles: Float64[np.ndarray, "m 13"]) -> None:
    rod = Rod(PROPERTIES, 40)
    exact = Rod(PROPERTIES, 40, tolerance=1e-12)
    state = moving_state(exact, obstacles)
    for _ in range(20):
        spec = RolloutSpec(state, ACTIONS[:1], 0.01, obstacles=obstacles)
        solved, solution = rod.rollout(spec), exact.rollout(spec)
        assert solved.converged.all()
        assert np.abs(solved.positions - solution.positions).max() < 1e-7
        derived = rod.linearize(spec).rollout
        assert np.abs(derived.positions - solution.positions).max() < 1e-7
        state = solution.final
