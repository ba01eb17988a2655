"""The differentiable rod; knows no bus, file or clock."""

from __future__ import annotations

from lariat.rod.parameters import PARAMETERS
from lariat.rod.properties import RodProperties
from lariat.rod.rod import Rod
from lariat.rod.state import (
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
