"""The planner's rope is the one that the controller has learnt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from services.controller.estimation.material_filter import MaterialFilter
from services.planner.parameter_update import learnt_rope
from tests.services.controller.cell import PROPERTIES


def test_every_learnt_parameter_comes_back() -> None:
    rope = replace(
        PROPERTIES,
        length=0.453,
        damping=2.0,
        stiffness_profile=(0.8, 1.1, 1.2),
        rest_curvature=((0.3, -0.2, 0.1),),
    ).with_stiffness(3e-3, 2e-3)
    adaptation = MaterialFilter(PROPERTIES)
    adaptation.properties = rope
    values = {e.name: e.value for e in adaptation.estimates}
    found = learnt_rope(PROPERTIES, values)
    for name in ("length", "damping", "bending_stiffness", "twisting_stiffness"):
        assert np.isclose(getattr(found, name), getattr(rope, name), rtol=1e-12)
    assert np.allclose(found.stiffness_profile, rope.stiffness_profile)
    assert np.allclose(found.rest_curvature, rope.rest_curvature)
    assert found.linear_density == rope.linear_density


def test_what_was_not_learnt_stays_as_given() -> None:
    assert learnt_rope(PROPERTIES, {"damping": 2.0}) == replace(
        PROPERTIES, damping=2.0
    ).with_stiffness(PROPERTIES.bending_stiffness, PROPERTIES.twisting_stiffness)
