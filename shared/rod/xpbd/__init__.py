"""The paper's rod: position-based Cosserat dynamics, Algorithm 1 with eqs. (2) to (11)."""

from __future__ import annotations

from shared.rod.xpbd.answers import PARAMETERS
from shared.rod.xpbd.properties import XpbdProperties
from shared.rod.xpbd.rod import Slope, XpbdRod

__all__ = ["PARAMETERS", "Slope", "XpbdProperties", "XpbdRod"]
