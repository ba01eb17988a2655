"""Learnt parameters by name."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from shared.messages import Estimate, Parameters, RodParameters, XpbdParameters
from shared.messages.parameters import described, held_ends, named_parameters


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


@pytest.mark.parametrize(
    ("name", "words", "unit"),
    [
        ("bending_stiffness", "bending stiffness", "N m^2"),
        ("stiffness_profile_2", "stiffness profile, knot 2", "-"),
        ("rest_curvature_6", "rest curvature about d3, knot 2", "1/m"),
        ("grip_offset_1", "grip offset, left x", "m"),
        ("grip_rotation_5", "grip rotation, right y", "rad"),
        ("bending_compliance", "bending compliance", "m^2/N"),
    ],
)
def test_parameters_are_described_by_side_axis_and_unit(name: str, words: str, unit: str) -> None:
    assert described(name) == (words, unit)
