"""Condition of the arms, as far as a run depends on it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ArmCondition:
    """Condition of the arms that decides whether they are controlled."""

    armed: bool
    """Whether they are armed."""
    available: bool
    """Whether they would follow setpoints: armed, and no stop waits for a person."""
    reason: str
    """Reason of their mode, in words."""
    reset_count: int
    """Number of resets that they have carried out."""
    refused_chunks: int
    """Chunks of this controller that the gateway has refused since the last accepted one."""
    refusal: str
    """Reason of the last refusal, in words."""
