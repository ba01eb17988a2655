"""Update of the planner's rope with the material that the controller has learnt."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import numpy as np

from lariat.control.estimation.rope_unknowns import RopeUnknowns
from lariat.planning.certain_clearance import drawn_ropes
from lariat.planning.problem import DrawnRope
from lariat.planning.rope_model import RopeModel
from lariat.rod import RodProperties
from lariat.rope_parameters import MATERIAL
from shared.messages import Parameters, RodParameters
from shared.messages.parameters import held_ends, rod_estimates

log = logging.getLogger(__name__)

ROD_PARAMETERS = tuple(parameter for parameter in MATERIAL if parameter.published)
"""Parameters of the message that are properties of the rod."""
MAX_LOG_STIFFNESS_DEVIATION = 0.7
"""Largest standard deviation of the stiffness's logarithm that paths allow for [-]; a rope that is
known less is learnt first."""


def update(rope: RopeModel, parameters: Parameters, draws: bool = False) -> None:
    """Give the planner's rope the set and the properties that the controller's model has."""
    rope.take_set(np.asarray(parameters.plastic_curvature, float))
    learnt = parameters.rod
    if not is_learnt(learnt):
        return
    try:
        properties = updated_properties(rope.given, learnt)
        unsure = unsure_properties(properties, learnt)
    except ValueError as error:
        log.warning("identified properties are not used: %s", error)
        return
    drawn = _drawn(rope, parameters) if draws else ()
    rope.update(properties, unsure, held_ends(learnt), drawn)


def _drawn(rope: RopeModel, parameters: Parameters) -> tuple[DrawnRope, ...]:
    """Ropes drawn from the distribution of the unknowns; none where another method states it."""
    unknowns, mean = RopeUnknowns.of(rope.given), np.array(parameters.unknowns)
    if len(mean) != unknowns.count:
        return ()
    covariance = np.zeros((len(mean), len(mean)))
    covariance[np.tril_indices(len(mean))] = parameters.covariance
    return drawn_ropes(rope.rod, unknowns, mean, covariance, abs(parameters.stamp))


def is_learnt(parameters: RodParameters) -> bool:
    """Whether any parameter has been estimated, not only given."""
    return any(
        estimate.standard_deviation > 0.0
        for parameter in ROD_PARAMETERS
        for estimate in rod_estimates(parameters, parameter)
    )


def updated_properties(properties: RodProperties, learnt: RodParameters) -> RodProperties:
    """Properties of the given rope with every parameter that has been estimated."""
    values = {}
    for parameter in ROD_PARAMETERS:
        estimates = rod_estimates(learnt, parameter)
        if estimates and all(estimate.standard_deviation > 0.0 for estimate in estimates):
            values[parameter.name] = [estimate.value for estimate in estimates]
    return properties.with_values(values)


def unsure_properties(rope: RodProperties, learnt: RodParameters) -> list[RodProperties]:
    """Properties with stiffness or length off by its standard deviation each.

    Where the grips are estimated too, an error of the length is made up by theirs, so that the
    shape that is seen is kept: a longer rope alone would hang lower than it can.
    """
    variants = []
    stiffness, length = learnt.bending_stiffness, learnt.length
    if stiffness.standard_deviation > 0.0:
        share = stiffness.standard_deviation / stiffness.value
        factor = math.exp(min(share, MAX_LOG_STIFFNESS_DEVIATION))
        variants.append(
            rope.with_stiffness(factor * rope.bending_stiffness, factor * rope.twisting_stiffness)
        )
    if length.standard_deviation > 0.0 and not learnt.grip_offset:
        variants.append(replace(rope, length=rope.length + length.standard_deviation))
    return variants
