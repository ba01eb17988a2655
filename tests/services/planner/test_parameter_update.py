from __future__ import annotations

from dataclasses import replace

import numpy as np

from services.planner.parameter_update import is_learnt, unsure_properties, updated_properties
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
