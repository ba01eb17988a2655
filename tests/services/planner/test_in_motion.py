"""The pace that is chosen is the best of all, though most are not followed to their end."""

from __future__ import annotations

import numpy as np
import pytest

from services.planner import in_motion
from services.planner.in_motion import on_the_clock
from services.planner.optimisation import PathOptimisation
from services.planner.problem import Problem
from services.planner.starts import starts
from tests.services.planner.test_whole_path import behind_the_wall

__all__ = ["behind_the_wall"]


def test_no_pace_that_is_left_out_would_have_been_better(
    behind_the_wall: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    optimisation = PathOptimisation(behind_the_wall)
    first = min(optimisation.trials(starts(behind_the_wall, 12)), key=lambda t: t.cost)
    trial = optimisation.refined(first, 4)
    together = on_the_clock(behind_the_wall, optimisation, trial)
    paces = in_motion.PACES[: in_motion.HURRIED]
    costs, alone = [], []
    for pace in paces:
        monkeypatch.setattr(in_motion, "PACES", (pace,))
        path = on_the_clock(behind_the_wall, optimisation, trial)
        swing = in_motion._moved(behind_the_wall, path.positions, path.orientations)[1]
        costs.append(len(path.positions) * path.dt + np.log1p(swing / in_motion.CALM))
        alone.append(path)
    assert min(p.clearance for p in alone) > in_motion.ENOUGH * optimisation.wanted
    best = alone[int(np.argmin(costs))]
    assert np.array_equal(together.positions, best.positions)
    assert together.clearance == best.clearance
