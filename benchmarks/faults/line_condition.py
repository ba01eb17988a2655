"""Conditions of the simulated network between a gateway and its arm."""

from __future__ import annotations

from typing import Literal

LineCondition = Literal["normal", "blocked", "delayed", "fragmented", "corrupted"]
"""normal: bytes pass. blocked: bytes are held until the condition changes. delayed: each way.
fragmented: in pieces of random size. corrupted: some bytes from the arm are replaced."""
LineCommand = LineCondition | Literal["cut"]
"""A condition, or to close every connection."""
