"""The paper's rod: position-based Cosserat dynamics, Algorithm 1 with eqs. (2) to (11)."""

from __future__ import annotations

from lariat.rod.xpbd.launch.outputs import PARAMETERS
from lariat.rod.xpbd.properties import XpbdProperties
from lariat.rod.xpbd.rod import Slope, XpbdRod

__all__ = ["PARAMETERS", "Slope", "XpbdProperties", "XpbdRod"]
