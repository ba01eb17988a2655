"""Rod of the paper: position-based Cosserat dynamics (Ying & Yamazaki 2024, Algorithm 1)."""

from __future__ import annotations

from lariat.paper.xpbd.parameters import PARAMETERS
from lariat.paper.xpbd.properties import XpbdProperties
from lariat.paper.xpbd.rod import XpbdRod

__all__ = ["PARAMETERS", "XpbdProperties", "XpbdRod"]
