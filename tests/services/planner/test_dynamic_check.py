"""The pace that is chosen is the best of all, though most are not followed to their end."""

from __future__ import annotations

import numpy as np
import pytest

from services.planner import dynamic_check
from services.planner.dynamic_check import on_the_clock
from services.planner.path_optimization import PathOptimisation
from services.planner.problem import Problem
from services.planner.seeds import starts
from tests.services.planner.test_whole_path import behind_the_wall

__all__ = ["behind_the_wall"]


def test_no_pace_that_is_left_out_would_have_been_better(
    behind_the_wall: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    optimisation = PathOptimisation(behind_the_wall)
    first = min(optimisation.trials(starts(behind_the_wall, 12)), key=lambda t: t.cost)
    trial = optimisation.refined(first, 4)
    together = on_the_clock(behind_the_wall, optimisation, trial)
    paces = dynamic_check.PACES[: dynamic_check.HURRIED]
    costs, alone = [], []
    for pace in paces:
        monkeypatch.setattr(dynamic_check, "PACES", (pace,))
        path = on_the_clock(behind_the_wall, optimisation, trial)
        swing = dynamic_check._moved(behind_the_wall, path.positions, path.orientations)[1]
        costs.append(len(path.positions) * path.dt + np.log1p(swing / dynamic_check.CALM))
        alone.append(path)
    assert min(p.clearance for p in alone) > dynamic_check.ENOUGH * optimisation.wanted
    best = alone[int(np.argmin(costs))]
    assert np.array_equal(together.positions, best.positions)
    assert together.clearance == best.clearance
