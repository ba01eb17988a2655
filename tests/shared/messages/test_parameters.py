"""Learnt parameters are typed fields; name lists of old recordings are read into them."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from shared import topics
from shared.messages import Estimate, Parameter, Parameters, RodParameters, XpbdParameters
from shared.messages.parameters import fill_typed_fields, held_ends, named_parameters
from shared.recording import Entry

NAMES = (
    "bending_stiffness",
    "twist_ratio",
    "damping",
    "length",
    "stiffness_profile_1",
    "stiffness_profile_2",
    "rest_curvature_1",
    "rest_curvature_2",
    "rest_curvature_3",
)
OLD = Parameters(
    stamp=5,
    parameters=[
        Parameter(name=name, value=k + 1.0, standard_deviation=0.1 * k)
        for k, name in enumerate(NAMES)
    ],
)


def test_parameters_of_an_old_recording_are_read_into_typed_fields() -> None:
    key = topics.CONTROLLER_PARAMETERS.key
    entry = Entry(key, "lariat.Parameters", OLD.SerializeToString(), "controller", 0, 5)
    message = entry.parse()
    assert not message.parameters
    assert message.rod.twist_ratio == Estimate(value=2.0, standard_deviation=0.1)
    assert [e.value for e in message.rod.stiffness_profile] == [5.0, 6.0]
    assert [e.value for e in message.rod.rest_curvature] == [7.0, 8.0, 9.0]
    assert not message.HasField("xpbd")


def test_old_names_and_values_are_listed_as_before() -> None:
    message = Parameters.FromString(OLD.SerializeToString())
    fill_typed_fields(message)
    listed = {p.name: (p.value, p.standard_deviation) for p in named_parameters(message)}
    assert listed == {p.name: (p.value, p.standard_deviation) for p in OLD.parameters}
    assert tuple(listed) == NAMES


def test_typed_message_is_left_as_it_is() -> None:
    message = Parameters(rod=RodParameters(length=Estimate(value=0.45)))
    before = message.SerializeToString(deterministic=True)
    fill_typed_fields(message)
    assert message.SerializeToString(deterministic=True) == before


def test_parameters_of_the_papers_rod_have_no_deviations() -> None:
    rows = named_parameters(Parameters(xpbd=XpbdParameters(mass=0.001, bending_compliance=0.02)))
    assert rows[0].name == "mass"
    assert all(p.standard_deviation == 0.0 for p in rows)


def test_ends_are_where_the_grips_are_estimated_to_hold_them() -> None:
    values = np.linspace(-0.02, 0.03, 12)
    estimates = [Estimate(value=value, standard_deviation=1e-3) for value in values]
    ends = held_ends(RodParameters(grip_offset=estimates[:6], grip_rotation=estimates[6:]))
    for k, end in enumerate(ends):
        assert end.position == pytest.approx(values[3 * k : 3 * k + 3])
        turned = poses.logarithm(end.orientation)
        assert turned == pytest.approx(values[6 + 3 * k : 9 + 3 * k])


def test_grips_that_are_not_estimated_are_exact() -> None:
    given = [Estimate(value=0.01)] * 6
    for message in (RodParameters(), RodParameters(grip_offset=given, grip_rotation=given)):
        for end in held_ends(message):
            assert end.position == pytest.approx(np.zeros(3))
            assert end.orientation == pytest.approx([1.0, 0.0, 0.0, 0.0])
