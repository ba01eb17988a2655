"""Offset of seen and hidden nodes, and the switch to another equilibrium."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.control.estimation.grip_errors import GripErrors
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry import polylines
from lariat.rod import Rod, RodProperties, RodState, add_turns, count_turns, state_along
from lariat.trajectory import MotionState
from tests.services.controller.cell import grips

ROD = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 24)
NEAR = grips((-0.06, 0.0, 0.4), (0.06, 0.0, 0.4))
WIDE = grips((-0.14, 0.0, 0.4), (0.14, 0.05, 0.42))
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


def test_estimator_switches_to_a_wound_equilibrium_with_other_turns() -> None:
    rod = Rod(replace(ROD.properties, youngs_modulus=1e7), 24)

    def led(start: RodState, *halves: float) -> RodState:
        for x in halves:
            start = rod.rest(*grips((-x, 0.0, 0.4), (x, 0.0, 0.4)), guess=start).state
        return start

    # Two turns throw a loop, to this or to that side, depending on where the grips come from.
    wide = rod.rest(*grips((-0.2, 0.0, 0.4), (0.2, 0.0, 0.4))).state
    wound = led(add_turns(wide, 2), *np.arange(20, 4, -1) / 100)
    other = led(add_turns(wide, 2), 0.2, 0.03, 0.04, 0.05)
    assert count_turns(wound) != count_turns(other)
    near = MotionState.at_rest(*grips((-0.05, 0.0, 0.4), (0.05, 0.0, 0.4)))
    estimator = StateEstimator(rod, near, 0)
    estimator.state = wound
    assert estimator.switch_equilibrium(other.positions, ALL)
    assert polylines.mean_node_distance(estimator.nodes, other.positions) < 2e-3
    assert estimator.turns == count_turns(other)


def test_estimator_keeps_its_equilibrium_for_a_rope_held_aside() -> None:
    estimator = StateEstimator(ROD, MotionState.at_rest(*NEAR), 0)
    before = estimator.nodes
    bump = np.sin(np.linspace(0.0, np.pi, 24))[:, None] * [0.0, 0.05, 0.03]
    assert not estimator.switch_equilibrium(before + bump, ALL)
    assert np.array_equal(estimator.nodes, before)


def test_offset_of_hidden_nodes_is_interpolated_between_seen_ones() -> None:
    estimator = StateEstimator(ROD, MotionState.at_rest(*NEAR), 0)
    before, shift = estimator.nodes, np.array([0.0, 0.006, 0.0])
    observed = ALL.copy()
    observed[9:15] = False
    nodes = before + shift
    # Whatever an observation says of nodes that were not seen.
    nodes[9:15] += 0.1
    for k in range(60):
        estimator.observe(RopeObservation(k * 40_000_000, nodes, np.full(24, 1e-3), observed))
    np.testing.assert_allclose(estimator.offset[5:19], np.tile(shift, (14, 1)), atol=3e-4)


def test_image_is_compared_with_the_model_at_its_own_time() -> None:
    estimator = StateEstimator(ROD, MotionState.at_rest(*NEAR), 0)
    aside = MotionState.at_rest(*grips((-0.06, 0.03, 0.4), (0.06, 0.03, 0.4)))
    seen = estimator.nodes
    for k in range(1, 6):
        seen = estimator.nodes
        estimator.advance(MotionState.at_rest(*NEAR) if k < 5 else aside, 20_000_000 * k)
    assert np.linalg.norm(estimator.nodes - seen, axis=1).max() > 0.02
    estimator.observe(RopeObservation(80_000_000, seen, np.full(24, 1e-4), ALL))
    assert np.abs(estimator.offset).max() < 1e-6


def test_model_is_carried_to_its_new_shape_without_swinging() -> None:
    estimator = StateEstimator(ROD, MotionState.at_rest(*WIDE), 0)
    soft, nodes = replace(ROD.properties, youngs_modulus=2e5), estimator.nodes
    errors = GripErrors(np.array([[0.002, 0.0, 0.001], [0.0, -0.002, 0.0]]), np.zeros((2, 3)))
    rod = estimator.rod.with_properties(soft)  # pyright: ignore[reportAttributeAccessIssue]
    estimator.change_material(rod, np.zeros_like(nodes), errors)
    rest = rod.rest(*errors.held(estimator.motion).grips).state.positions
    assert np.abs(estimator.state.positions - rest).max() < 2e-4
    # The estimated nodes stay where they are, except the ends, which the grips hold.
    assert np.abs(estimator.nodes - nodes)[1:-1].max() < 1e-12
    for _ in range(20):
        estimator.advance(estimator.motion, estimator.time + 20_000_000)
    assert np.abs(estimator.state.positions - rest).max() < 3e-4
