"""Attempt of somebody who may not do it, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Attack:
    """Attempt of somebody who may not do it."""

    who: str
    """Attacker."""
    attempt: str
    """What they try."""
    outcome: str
    """What comes of it, in words."""
    held: bool
    """Whether it was refused."""


class NoControl(RuntimeError):
    """What must be possible is not, so that the refusal of an attack would prove nothing."""
