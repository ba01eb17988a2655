from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry.obstacles import TABLE
from lariat.planning import retiming
from lariat.planning.dynamic_check import simulate_path
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.problem import Problem
from lariat.planning.retiming import retime
from tests.lariat.planning.test_whole_path import behind_the_wall

__all__ = ["behind_the_wall"]


def test_no_skipped_pace_is_better_than_the_chosen_one(behind_the_wall: Problem) -> None:
    problem = replace(behind_the_wall, obstacles=(TABLE,))
    optimizer = PathOptimizer(problem)
    candidate = optimizer.refine(optimizer.direct(), 4)
    together = retime(problem, optimizer, candidate)
    costs, alone = [], []
    for pace in retiming.PACES:
        path = retime(problem, optimizer, candidate, paces=(pace,))
        swing = simulate_path(problem, path.positions, path.orientations, path.dt)[1]
        costs.append(len(path.positions) * path.dt + np.log1p(swing / retiming.NEGLIGIBLE_SWING))
        alone.append(path)
    sufficient = retiming.SUFFICIENT_CLEARANCE * optimizer.wanted_clearance
    assert min(p.clearance for p in alone) > sufficient
    best = alone[int(np.argmin(costs))]
    assert np.array_equal(together.positions, best.positions)
    assert together.clearance == best.clearance
