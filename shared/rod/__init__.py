"""The differentiable rod; knows no bus, file or clock."""

from __future__ import annotations

from shared.rod.properties import RodProperties
from shared.rod.rod import PARAMETERS, Rod
from shared.rod.state import Gradient, Linearization, Rest, RodState, Rollout, StateGradient

__all__ = [
    "PARAMETERS",
    "Gradient",
    "Linearization",
    "Rest",
    "Rod",
    "RodProperties",
    "RodState",
    "Rollout",
    "StateGradient",
]
