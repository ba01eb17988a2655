"""Status of a cell after a tick."""

from __future__ import annotations

from dataclasses import dataclass

from services.robot_gateway.constraints.rule import Rule
from services.robot_gateway.drivers.driver import ArmFeedback
from services.robot_gateway.safety.state_machine import SafetyState


@dataclass(frozen=True)
class CellStatus:
    """Status of the cell after a tick."""

    safety: SafetyState
    braking: bool
    """Whether the command brakes."""
    rule: Rule | None
    """Rule that was broken last."""
    refusal: str
    """Reason for refusing the chunk that was refused last."""
    sequence: int
    """Sequence number of the chunk that was accepted last."""
    refused_sequence: int
    """Sequence number of the chunk that was refused last."""
    command: str
    """Id of the command that was handled last."""
    rejection: str
    """Reason why that command was not carried out; empty if it was."""
    arms: tuple[ArmFeedback, ...]
    """Feedback of each end, left first."""
    tracking: tuple[float, ...]
    """Distance between command and feedback of each end [m]."""
    reset_count: int
    """Count of the reset that was carried out last."""
