"""Update of the planner's rope with the material that the controller has learnt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lariat.rod import RodProperties
from shared.messages import Estimate, RodParameters


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


def _value(estimate: Estimate, given: float) -> float:
    return estimate.value if estimate.standard_deviation > 0.0 else given


def _values(estimates: Sequence[Estimate]) -> list[float]:
    """Values of a profile; none unless all have been estimated."""
    if not all(estimate.standard_deviation > 0.0 for estimate in estimates):
        return []
    return [estimate.value for estimate in estimates]
