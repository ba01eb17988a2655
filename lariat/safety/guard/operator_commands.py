"""Commands of a person, and the conditions under which they count.

A stop is always obeyed. Any other command counts only as the answer to a state of this start of the
gateway that is recent by the gateway's own clock, and that no change of state has outdated: nobody
permits motion in a state that they have not seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lariat.trajectory import NANOSECONDS

Action = Literal["arm", "approach", "disarm", "hold", "acknowledge", "resume", "gripper"]

STOP_ACTIONS: tuple[Action, ...] = ("disarm", "hold")
"""Actions that are obeyed whatever boot id they carry and whatever state they answer."""
COMMAND_VALIDITY = 1.0
"""Age of the state that a command answers, above which it is void [s]."""


@dataclass(frozen=True)
class OperatorCommand:
    """Command of a person."""

    id: str
    boot: str
    """Id of the gateway's start that the person saw."""
    answers: int
    """Stamp of the newest state that the person's side had, by the gateway's clock [ns]."""
    action: Action
    arm: str = ""
    """Arm whose gripper opens or closes."""
    close: bool = False
    """Whether the gripper closes."""
    distance: float = 0.0
    """Distance of the approach that the person was shown [m]."""
    angle: float = 0.0
    """Angle of the approach that the person was shown [rad]."""
    session: str = ""
    """Writer that the person was shown."""
    origin: str = "a person"
    """Who stops the arms, in words."""


class CommandRejected(ValueError):
    """A command that is not carried out, with the reason for the person."""


def check_command(command: OperatorCommand, boot: str, now: int, changed: int) -> None:
    """Check that a command is a stop, or answers a recent state of this start of the gateway.

    Args:
        command: Command of a person.
        boot: Id of this start of the gateway.
        now: Present time [ns].
        changed: Time of the first state that shows what holds now [ns].

    Raises:
        CommandRejected: It is neither.
    """
    if command.action in STOP_ACTIONS:
        return
    if command.boot != boot:
        raise CommandRejected(
            f"meant for boot {command.boot!r}, but this is {boot!r}; check the state again"
        )
    age = (now - command.answers) * NANOSECONDS
    if not 0.0 <= age <= COMMAND_VALIDITY:
        raise CommandRejected(
            f"answers a state that is {age:.3f} s old, and may be {COMMAND_VALIDITY:g} s; "
            "nothing was done"
        )
    if command.answers < changed:
        raise CommandRejected(
            "the state has changed since the one that it answers; check the state again"
        )
