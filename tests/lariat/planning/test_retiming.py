from __future__ import annotations

import numpy as np

from lariat.planning import retiming
from lariat.planning.path_check import simulate_path
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.problem import Problem
from lariat.planning.retiming import retime
from lariat.planning.seeds import seed_paths
from tests.lariat.planning.test_whole_path import behind_the_wall

__all__ = ["behind_the_wall"]


def test_no_skipped_pace_is_better_than_the_chosen_one(behind_the_wall: Problem) -> None:
    optimizer = PathOptimizer(behind_the_wall)
    seeds = [optimizer.translated(seed) for seed in seed_paths(behind_the_wall)]
    candidate = optimizer.refine(min(seeds, key=lambda c: c.cost), 4)
    together = retime(optimizer, candidate)
    costs, alone = [], []
    for pace in retiming.PACES:
        path = retime(optimizer, candidate, paces=(pace,))
        swing = simulate_path(behind_the_wall, path)[1]
        costs.append(len(path.positions) * path.dt + np.log1p(swing / retiming.NEGLIGIBLE_SWING))
        alone.append(path)
    sufficient = retiming.SUFFICIENT_CLEARANCE * optimizer.wanted_clearance
    assert min(p.clearance for p in alone) > sufficient
    best = alone[int(np.argmin(costs))]
    assert np.array_equal(together.positions, best.positions)
    assert together.clearance == best.clearance
