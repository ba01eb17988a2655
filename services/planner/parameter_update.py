"""Update of the planner's rope with the material that the controller has learnt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lariat.rod import RodProperties
from shared.messages import Estimate, RodParameters

MAX_LOG_STIFFNESS_DEVIATION = 0.7
"""Largest standard deviation of the stiffness's logarithm that paths allow for [-]; a rope that is
known less is learnt first."""


def is_learnt(parameters: RodParameters) -> bool:
    """Whether any parameter has been estimated, not only given."""
    scalars = (
        parameters.bending_stiffness,
        parameters.twist_ratio,
        parameters.damping,
        parameters.length,
    )
    estimates = (*scalars, *parameters.stiffness_profile, *parameters.rest_curvature)
    return any(estimate.standard_deviation > 0.0 for estimate in estimates)


def updated_properties(given: RodProperties, learnt: RodParameters) -> RodProperties:
    """Properties of the given rope with every parameter that has been estimated.

    Args:
        given: Rope of the scenario.
        learnt: Parameters of the controller; those without a standard deviation stay as given.
    """
    profile = _values(learnt.stiffness_profile)
    curvature = np.reshape(_values(learnt.rest_curvature), (-1, 3)).tolist()
    given_ratio = given.twisting_stiffness / given.bending_stiffness
    ratio = _value(learnt.twist_ratio, given_ratio)
    stiffness = _value(learnt.bending_stiffness, given.bending_stiffness)
    return replace(
        given,
        length=_value(learnt.length, given.length),
        damping=_value(learnt.damping, given.damping),
        stiffness_profile=tuple(profile) or given.stiffness_profile,
        rest_curvature=tuple((a, b, c) for a, b, c in curvature) or given.rest_curvature,
    ).with_stiffness(stiffness, ratio * stiffness)


def unsure_properties(rope: RodProperties, learnt: RodParameters) -> list[RodProperties]:
    """Properties with stiffness or length off by its standard deviation each.

    Where the grips are estimated too, an error of the length is made up by theirs, so that the
    shape that is seen is kept: a longer rope alone would hang lower than it can.

    Args:
        rope: Rope with the learnt parameters.
        learnt: Parameters of the controller; those without a standard deviation are given.
    """
    found = []
    stiffness, length = learnt.bending_stiffness, learnt.length
    if stiffness.standard_deviation > 0.0:
        share = stiffness.standard_deviation / stiffness.value
        factor = math.exp(min(share, MAX_LOG_STIFFNESS_DEVIATION))
        found.append(
            rope.with_stiffness(factor * rope.bending_stiffness, factor * rope.twisting_stiffness)
        )
    if length.standard_deviation > 0.0 and not learnt.grip_offset:
        found.append(replace(rope, length=rope.length + length.standard_deviation))
    return found


def _value(estimate: Estimate, given: float) -> float:
    return estimate.value if estimate.standard_deviation > 0.0 else given


def _values(estimates: Sequence[Estimate]) -> list[float]:
    """Values of a profile; none unless all have been estimated."""
    if not all(estimate.standard_deviation > 0.0 for estimate in estimates):
        return []
    return [estimate.value for estimate in estimates]
