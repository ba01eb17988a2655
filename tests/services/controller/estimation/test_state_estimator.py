"""The estimate takes another shape of rest for what it is, and no rope that hangs on something."""

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


def test_rope_in_its_other_shape_of_rest_is_followed_there() -> None:
    s = np.linspace(0.0, 1.0, 200)[:, None]
    loop = np.hstack([np.sin(2.0 * np.pi * s) * 0.06, 0.0 * s, 0.4 - 0.3 * s * (1.0 - s) * 2.0])
    loop[:, :1] += -0.06 + 0.12 * s
    guess = state_along(polylines.resample(loop, 24), *(g.orientation for g in NEAR))
    other = ROD.rest(*NEAR, guess=guess).state.positions
    estimate = StateEstimator(ROD, MotionState.at_rest(*NEAR), 0)
    assert polylines.mean_node_distance(estimate.nodes, other) > 0.02
    assert estimate.switch_equilibrium(other, ALL)
    assert polylines.mean_node_distance(estimate.nodes, other) < 1e-3


def test_rope_held_aside_has_no_such_shape() -> None:
    estimate = StateEstimator(ROD, MotionState.at_rest(*NEAR), 0)
    before = estimate.nodes
    bump = np.sin(np.linspace(0.0, np.pi, 24))[:, None] * [0.0, 0.05, 0.03]
    assert not estimate.switch_equilibrium(before + bump, ALL)
    assert np.array_equal(estimate.nodes, before)
