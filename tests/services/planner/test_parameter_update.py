from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.control.estimation.material_filter import MaterialFilter
from lariat.control.estimation.rope_unknowns import RopeUnknowns
from lariat.planning.certain_clearance import DRAWS
from lariat.planning.rope_model import RopeModel
from lariat.scenario import load
from lariat.trajectory import SECOND
from services.controller.messages import parameters_message
from services.planner.parameter_update import (
    is_learnt,
    unsure_properties,
    update,
    updated_properties,
)
from shared.messages import Estimate, RodParameters
from tests.services.controller.cell import PROPERTIES


def learnt(value: float) -> Estimate:
    return Estimate(value=value, standard_deviation=0.1)


def test_every_learnt_parameter_is_applied() -> None:
    found = updated_properties(
        PROPERTIES,
        RodParameters(
            bending_stiffness=learnt(3e-3),
            twist_ratio=learnt(2.0 / 3.0),
            damping=learnt(2.0),
            length=learnt(0.453),
            stiffness_profile=[learnt(0.8), learnt(1.1), learnt(1.2)],
            rest_curvature=[learnt(0.3), learnt(-0.2), learnt(0.1)],
        ),
    )
    assert (found.length, found.damping) == (0.453, 2.0)
    assert np.isclose(found.bending_stiffness, 3e-3, rtol=1e-12)
    assert np.isclose(found.twisting_stiffness, 2e-3, rtol=1e-12)
    assert found.stiffness_profile == (0.8, 1.1, 1.2)
    assert found.rest_curvature == ((0.3, -0.2, 0.1),)
    assert found.linear_density == PROPERTIES.linear_density


def test_parameters_without_a_standard_deviation_stay_as_given() -> None:
    message = RodParameters(damping=learnt(2.0), length=Estimate(value=0.6))
    assert updated_properties(PROPERTIES, message) == replace(
        PROPERTIES, damping=2.0
    ).with_stiffness(PROPERTIES.bending_stiffness, PROPERTIES.twisting_stiffness)


def test_given_parameters_are_not_learnt() -> None:
    assert not is_learnt(RodParameters(damping=Estimate(value=1.0)))
    assert is_learnt(RodParameters(damping=learnt(1.0)))


def test_unsure_properties_are_off_by_one_standard_deviation_each() -> None:
    stiffness = PROPERTIES.bending_stiffness
    message = RodParameters(
        bending_stiffness=Estimate(value=stiffness, standard_deviation=0.1 * stiffness),
        length=Estimate(value=0.45, standard_deviation=0.002),
    )
    stiffer, longer = unsure_properties(PROPERTIES, message)
    assert np.isclose(stiffer.bending_stiffness, np.exp(0.1) * stiffness)
    assert stiffer.length == PROPERTIES.length
    assert np.isclose(longer.length, PROPERTIES.length + 0.002)
    assert longer.bending_stiffness == stiffness
    message.grip_offset.extend([Estimate(value=0.0, standard_deviation=1e-3)] * 6)
    (only,) = unsure_properties(PROPERTIES, message)
    assert only == stiffer
    given = RodParameters(bending_stiffness=Estimate(value=stiffness))
    assert unsure_properties(PROPERTIES, given) == []


def test_ropes_are_drawn_from_what_the_filter_states_of_rope_and_grips() -> None:
    scenario = load("three-cylinders")
    rope = RopeModel(scenario.rope, scenario.moves)
    learnt_by = MaterialFilter(rope.given)
    _, covariance = learnt_by.distribution
    message = parameters_message(learnt_by, SECOND, 0.0, adapts=True)
    update(rope, message)
    assert not rope.drawn
    update(rope, message, draws=True)
    assert len(rope.drawn) == DRAWS
    groups = RopeUnknowns.of(rope.given).groups
    lengths = np.log([drawn.rod.properties.length / rope.given.length for drawn in rope.drawn])
    offsets = np.array([drawn.held[1].position for drawn in rope.drawn])
    stated = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(np.std(lengths), stated[groups["length"]], rtol=0.25)
    np.testing.assert_allclose(
        np.std(offsets, axis=0), stated[groups["grip_offset"]][3:], rtol=0.25
    )
    update(rope, parameters_message(learnt_by, 2 * SECOND, 0.0, adapts=True), draws=True)
    # Another path has other ropes: all of them cannot be wrong together.
    assert not np.any(np.isclose(offsets, [drawn.held[1].position for drawn in rope.drawn]))
    given = parameters_message(learnt_by, SECOND, 0.0, adapts=False)
    assert not given.unknowns
    del message.unknowns[:]
    update(rope, message, draws=True)
    assert rope.drawn == ()
