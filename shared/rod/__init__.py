"""The differentiable rod; knows no bus, file or clock."""

from __future__ import annotations

from shared.rod.parameters import PARAMETERS
from shared.rod.properties import RodProperties
from shared.rod.rod import Rod
from shared.rod.state import (
    Gradient,
    Linearization,
    Rest,
    RodState,
    Rollout,
    StateDirections,
    StateGradient,
)

__all__ = [
    "PARAMETERS",
    "Gradient",
    "Linearization",
    "Rest",
    "Rod",
    "RodProperties",
    "RodState",
    "Rollout",
    "StateDirections",
    "StateGradient",
]
