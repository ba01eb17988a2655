"""Batches of rods: one launch computes what separate launches compute, on any number of threads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod import Rod, RodProperties, RolloutSpec

PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6)
OBSTACLES = pack([Obstacle("sphere", (0.2, 0.0, 0.27), radius=0.02)])


@pytest.mark.parametrize("threads", [2, 3, 8])
def test_threads_share_a_batch_without_changing_its_results(threads: int) -> None:
    one, many = Rod(PROPERTIES, 12), Rod(PROPERTIES, 12, threads=threads)
    rng = np.random.default_rng(threads)
    start = one.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    states = [
        replace(start, velocities=0.3 * rng.standard_normal(start.velocities.shape))
        for _ in range(5)
    ]
    actions = rng.uniform(-0.3, 0.3, (5, 3, 2, 6))
    spec = RolloutSpec(states, actions, 0.01, obstacles=OBSTACLES)
    cost = rng.standard_normal((5, 3, 12, 3))
    for a, b in zip(one.rollout(spec), many.rollout(spec), strict=True):
        np.testing.assert_array_equal(a.positions, b.positions)
    for a, b in zip(one.linearize(spec), many.linearize(spec), strict=True):
        np.testing.assert_array_equal(a.d_positions_d_actions, b.d_positions_d_actions)
    for a, b in zip(one.gradient(spec, cost), many.gradient(spec, cost), strict=True):
        np.testing.assert_array_equal(a.actions, b.actions)
        assert a.parameters == b.parameters


def test_a_rod_without_threads_is_refused() -> None:
    with pytest.raises(ValueError, match="threads must be at least 1, got 0"):
        Rod(PROPERTIES, 12, threads=0)
