"""Rules that every motion must keep, the motion of commands under them, and the guard of a cell.

`check_motion` checks a motion of both grips against every rule of a scenario's cell.
"""

from __future__ import annotations

from lariat.safety.motion.validation import ChunkRefused
from lariat.safety.motion_check import check_motion

__all__ = ["ChunkRefused", "check_motion"]
