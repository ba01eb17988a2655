"""State machine of a cell: whether anything may move.

It depends on neither geometry nor devices. The rows of `stop_causes.py` state for each cause the
condition for moving again. At boot a cell is disarmed. Only a person's command leaves a state that
requires one. A command that permits motion is valid only with the boot id of this start and as an
answer to a recent state, by the gateway's own clock; a stop is always valid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from lariat.trajectory import NANOSECONDS
from services.robot_gateway.safety.stop_causes import STOP_CAUSES

Mode = Literal["disarmed", "armed", "moving", "holding", "fault"]
Action = Literal["arm", "approach", "disarm", "hold", "acknowledge", "resume", "gripper"]

STOP_ACTIONS: tuple[Action, ...] = ("disarm", "hold")
"""Actions that are obeyed whatever boot id they carry and whatever state they answer."""
COMMAND_VALIDITY = 1.0
"""Age of the state that a command answers, above which it is void [s]."""
DEVICE_CAUSES = ("alarm", "lost_link")
"""Causes from which a device must also recover."""


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


class CommandRejected(ValueError):
    """A command that is not carried out, with the reason for the person."""


@dataclass(frozen=True)
class SafetyState:
    """State of the cell; every transition returns a new value."""

    boot: str
    """Id of this start of the gateway."""
    mode: Mode = "disarmed"
    cause: str = "boot"
    """Row of `STOP_CAUSES` that explains the mode, or empty."""
    detail: str = "started; a person arms"
    """The cause in words, with numbers."""
    session: str = ""
    """Session of the writer that is followed; empty until the first one after arming."""
    waiting_session: str = ""
    """Session of a new writer that a person has not yet acknowledged."""

    @property
    def needs_acknowledgement(self) -> bool:
        """Whether a person must acknowledge before anything moves."""
        return (
            self.mode in ("holding", "fault")
            and STOP_CAUSES[self.cause].resumes == "after acknowledgement"
        )

    @property
    def may_move(self) -> bool:
        """Whether a valid chunk would be followed."""
        return self.mode in ("armed", "moving") or (
            self.mode == "holding" and not self.needs_acknowledgement
        )

    def check(self, command: OperatorCommand, now: int) -> None:
        """Check that a command is a stop, or meant for this start of the gateway and recent.

        Args:
            command: Command of a person.
            now: Present time [ns].

        Raises:
            CommandRejected: It is neither.
        """
        if command.action in STOP_ACTIONS:
            return
        if command.boot != self.boot:
            raise CommandRejected(
                f"meant for boot {command.boot!r}, but this is {self.boot!r}; check the state again"
            )
        age = (now - command.answers) * NANOSECONDS
        if not 0.0 <= age <= COMMAND_VALIDITY:
            raise CommandRejected(
                f"answers a state that is {age:.3f} s old, and may be {COMMAND_VALIDITY:g} s; "
                "nothing was done"
            )

    def armed(self, refusal: str = "") -> SafetyState:
        """Return the state after a person arms.

        Args:
            refusal: Reason why the cell cannot be armed, in words; empty where there is none.

        Raises:
            CommandRejected: The cell is armed already, or cannot be armed.
        """
        if self.may_move:
            raise CommandRejected(f"armed already ({self.mode}: {self.detail})")
        if self.mode != "disarmed":
            raise CommandRejected(f"cannot arm while {self.mode}; disarm or acknowledge first")
        if refusal:
            raise CommandRejected(refusal)
        return replace(self, mode="armed", cause="", detail="armed", session="", waiting_session="")

    def disarmed(self, detail: str = "disarmed by a person") -> SafetyState:
        """Return the state after a person disarms, from any state."""
        return replace(self, mode="disarmed", cause="disarm", detail=detail, session="")

    def acknowledged(self) -> SafetyState:
        """Return the state after a person acknowledges.

        Raises:
            CommandRejected: There is nothing to acknowledge.
        """
        if not self.needs_acknowledgement:
            raise CommandRejected(f"nothing to acknowledge while {self.mode}")
        # A person who acknowledges accepts the writer that is there, or the next one.
        return replace(
            self,
            mode="armed",
            cause="",
            detail="acknowledged",
            session=self.waiting_session or self.session,
            waiting_session="",
        )

    def stopped(self, cause: str, detail: str) -> SafetyState:
        """Return the state after something stopped the cell.

        A cause never weakens the condition for moving again: a disarmed cell stays disarmed, and
        one that waits for a person keeps its first cause, except that a fault outranks a hold.

        Args:
            cause: Row of `STOP_CAUSES`.
            detail: The cause in words, with numbers.
        """
        if self.mode == "disarmed":
            return self
        mode: Mode = "fault" if cause in DEVICE_CAUSES else "holding"
        if self.mode == "fault" or (self.needs_acknowledgement and mode != "fault"):
            return self
        return replace(self, mode=mode, cause=cause, detail=detail)

    def with_writer(self, session: str) -> SafetyState:
        """Return the state after a message of a writer; a new writer holds the cell."""
        if session in (self.session, self.waiting_session) or self.mode == "disarmed":
            return self
        if not self.session:
            return replace(self, session=session)
        held = self.stopped("new_writer", f"writer {session!r} replaces {self.session!r}")
        return replace(held, waiting_session=session)

    def moving(self, moves: bool) -> SafetyState:
        """Return the state while a chunk is followed (True), or once the command rests (False)."""
        if moves and self.may_move and self.mode != "moving":
            return replace(self, mode="moving", cause="", detail="following setpoints")
        if not moves and self.mode == "moving":
            return replace(self, mode="armed", cause="", detail="at rest")
        return self
