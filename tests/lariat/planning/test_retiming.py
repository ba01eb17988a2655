from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.planning.dynamic_check import simulate_path
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.problem import Problem
from lariat.planning.retiming import RETIMING_SETTINGS, retime
from lariat.planning.seeds import seed_paths
from tests.lariat.planning.test_whole_path import behind_the_wall

__all__ = ["behind_the_wall"]


def test_no_skipped_pace_is_better_than_the_chosen_one(behind_the_wall: Problem) -> None:
    optimizer = PathOptimizer(behind_the_wall)
    seeds = optimizer.evaluate(seed_paths(behind_the_wall, optimizer.settings.blocks))
    candidate = optimizer.refine(min(seeds, key=lambda c: c.cost), 4)
    together = retime(behind_the_wall, optimizer, candidate)
    costs, alone = [], []
    for pace in RETIMING_SETTINGS.paces:
        single = replace(RETIMING_SETTINGS, paces=(pace,), close_paces=())
        path = retime(behind_the_wall, optimizer, candidate, single)
        swing = simulate_path(behind_the_wall, path.positions, path.orientations, path.dt)[1]
        costs.append(
            len(path.positions) * path.dt + np.log1p(swing / RETIMING_SETTINGS.negligible_swing)
        )
        alone.append(path)
    sufficient = RETIMING_SETTINGS.sufficient_clearance * optimizer.wanted_clearance
    assert min(p.clearance for p in alone) > sufficient
    best = alone[int(np.argmin(costs))]
    assert np.array_equal(together.positions, best.positions)
    assert together.clearance == best.clearance
