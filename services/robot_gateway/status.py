"""Status of a cell after a tick."""

from __future__ import annotations

from dataclasses import dataclass

from lariat.safety.constraints.rule import Rule
from lariat.safety.guard.state_machine import SafetyState
from services.robot_gateway.drivers.driver import ArmFeedback
from services.robot_gateway.trajectory_control import State


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
    tracking: tuple[tuple[float, float], ...]
    """Distance and angle of each end from its path [m, rad]."""
    reset_count: int
    """Count of the reset that was carried out last."""
    remarks: str
    """What a person should know beside the state, in words."""
    next_session: str
    """Writer that arming or an acknowledgement would accept; empty: the next one."""
    needs_approach: bool
    """Whether the arms are away from the start and only an approach goes there."""
    approaching: bool
    """Whether an approach is under way, or waits for the arms to be ready."""
    approach_distance: float
    """Largest distance of an arm from the start [m]; 0 without an approach."""
    approach_angle: float
    """Largest angle of an arm from the start [rad]; 0 without an approach."""
    pauses: int
    """Number of pauses that a slow computer has caused."""
    trajectory: tuple[str, State, str]
    """Id and state of the joint trajectory that was handled last, and the reason of its end."""
