"""What a cell says of itself after a tick."""

from __future__ import annotations

from dataclasses import dataclass

from services.robot_gateway.constraints.rule import Rule
from services.robot_gateway.drivers.driver import Feedback
from services.robot_gateway.safety.state_machine import Safety


@dataclass(frozen=True)
class CellReport:
    """The cell after a tick."""

    safety: Safety
    braking: bool
    rule: Rule | None
    """Hit last."""
    refusal: str
    """Why the chunk refused last was refused."""
    sequence: int
    """Of the chunk accepted last."""
    refused_sequence: int
    command: str
    """Id of the command handled last."""
    rejection: str
    """Why that command was not carried out."""
    arms: tuple[Feedback, ...]
    tracking: tuple[float, ...]
    """Distance between command and feedback [m]."""
    reset_count: int
    """Of the reset carried out last."""
