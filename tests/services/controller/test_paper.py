"""The paper's methods lower their own objective."""

from __future__ import annotations

import numpy as np
import pytest

from services.controller.gauss_newton import Horizon
from services.controller.motion import Bounds
from services.controller.objective import Surroundings
from services.controller.paper import Actions, Network, PaperMethod, Policy
from shared.rod import Rod
from shared.scenario.sections import Limits, PaperControl
from tests.services.controller.cell import COUNT, PROPERTIES, grips


@pytest.mark.parametrize("name", ["actions", "network"])
def test_training_in_a_horizon_lowers_the_objective(name: str) -> None:
    settings = PaperControl()
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    policy: Policy = Actions(settings.horizon, 6)
    if name == "network":
        policy = Network(COUNT, 6, settings.learning_rate, seed=0)
    method = PaperMethod(policy, settings, moves, Bounds.share(Limits(), 1.0))
    rod = Rod(PROPERTIES, COUNT)
    state = rod.rest(*grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3))).state
    goal = rod.rest(*grips((-0.16, 0.1, 0.25), (0.18, 0.1, 0.3))).state.positions
    still = np.zeros((settings.horizon, 2, 6))
    horizon = Horizon(
        state,
        np.zeros_like(goal),
        still,
        np.repeat(goal[None], settings.horizon, axis=0),
        np.zeros((2, 2, 3)),
        np.zeros((2, 6)),
        np.zeros((2, 6), dtype=bool),
    )
    surroundings = Surroundings((), 0.01, 0.004, 0.44)
    standing = np.linalg.norm(state.positions - goal, axis=1).sum()
    plans = [method.plan(rod, horizon, surroundings) for _ in range(2)]
    total = sum(plans[-1].cost.values())
    assert total < standing
    assert plans[-1].cost["error"] < 0.99 * standing
