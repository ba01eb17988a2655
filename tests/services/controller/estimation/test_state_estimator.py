"""Switch to another equilibrium, and no switch for a rope that hangs on something."""

from __future__ import annotations

import numpy as np

from lariat.geometry import polylines
from lariat.rod import Rod, RodProperties, state_along
from lariat.trajectory import MotionState
from services.controller.estimation.state_estimator import StateEstimator
from tests.services.controller.cell import grips

ROD = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 24)
NEAR = grips((-0.06, 0.0, 0.4), (0.06, 0.0, 0.4))
ALL = np.ones(24, dtype=bool)


def test_estimator_switches_to_the_equilibrium_that_is_observed() -> None:
    s = np.linspace(0.0, 1.0, 200)[:, None]
    loop = np.hstack([np.sin(2.0 * np.pi * s) * 0.06, 0.0 * s, 0.4 - 0.3 * s * (1.0 - s) * 2.0])
    loop[:, :1] += -0.06 + 0.12 * s
    guess = state_along(polylines.resample(loop, 24), *(g.orientation for g in NEAR))
    other = ROD.rest(*NEAR, guess=guess).state.positions
    estimator = StateEstimator(ROD, MotionState.at_rest(*NEAR), 0)
    assert polylines.mean_node_distance(estimator.nodes, other) > 0.02
    assert estimator.switch_equilibrium(other, ALL)
    assert polylines.mean_node_distance(estimator.nodes, other) < 1e-3


def test_estimator_keeps_its_equilibrium_for_a_rope_held_aside() -> None:
    estimator = StateEstimator(ROD, MotionState.at_rest(*NEAR), 0)
    before = estimator.nodes
    bump = np.sin(np.linspace(0.0, np.pi, 24))[:, None] * [0.0, 0.05, 0.03]
    assert not estimator.switch_equilibrium(before + bump, ALL)
    assert np.array_equal(estimator.nodes, before)
