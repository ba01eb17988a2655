"""Differentiable Cosserat rod: roll-outs, derivatives and equilibria."""

from __future__ import annotations

from lariat.rod.initial_shapes import EDGE_AXIS, state_along
from lariat.rod.integration_schemes import Scheme
from lariat.rod.model import End
from lariat.rod.parameters import PARAMETERS
from lariat.rod.properties import RodProperties
from lariat.rod.protocol import DifferentiableRod
from lariat.rod.results import Gradient, Linearization, Rest, Rollout, StateGradient
from lariat.rod.rod import Rod
from lariat.rod.rollout_spec import CostGradient, RolloutSpec
from lariat.rod.state import RodState, StateDirections
from lariat.rod.strains import curvatures, forces, moments
from lariat.rod.twist import add_turns, connected, count_turns, count_turns_along

__all__ = [
    "EDGE_AXIS",
    "PARAMETERS",
    "CostGradient",
    "DifferentiableRod",
    "End",
    "Gradient",
    "Linearization",
    "Rest",
    "Rod",
    "RodProperties",
    "RodState",
    "Rollout",
    "RolloutSpec",
    "Scheme",
    "StateDirections",
    "StateGradient",
    "add_turns",
    "connected",
    "count_turns",
    "count_turns_along",
    "curvatures",
    "forces",
    "moments",
    "state_along",
]
