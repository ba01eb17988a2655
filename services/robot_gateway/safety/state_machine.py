"""Who may move: the state machine of a cell.

It knows no geometry and no device. Causes come from `causes.py`; what a cause's row says about
resuming is what happens here. Boot is disarmed. Only a person's command leaves a state that needs
one, and a command counts only with this start's boot id and before it expires.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from services.robot_gateway.safety.stop_causes import CAUSES

Mode = Literal["disarmed", "armed", "moving", "holding", "fault"]
Action = Literal["arm", "disarm", "hold", "acknowledge", "gripper"]

DEVICE_CAUSES = ("alarm", "lost_link")
"""Causes that a device must also recover from."""


@dataclass(frozen=True)
class Command:
    """What a person asks for."""

    id: str
    boot: str
    """Id of the gateway's start that the person saw."""
    expires: int
    """[ns]"""
    action: Action
    arm: str = ""
    """Which, for the gripper."""
    close: bool = False


class Rejected(ValueError):
    """A command that is not carried out, in words for the person."""


@dataclass(frozen=True)
class Safety:
    """State of the cell; every change is a new value."""

    boot: str
    """Id of this start of the gateway."""
    mode: Mode = "disarmed"
    cause: str = "boot"
    """Row of `CAUSES` that explains the mode, or empty."""
    detail: str = "started; a person arms"
    """The cause in words, with numbers."""
    session: str = ""
    """Writer that is followed; empty until the first one after arming."""
    waiting_session: str = ""
    """A new writer that a person has not yet acknowledged."""

    @property
    def needs_acknowledgement(self) -> bool:
        """Whether a person must acknowledge before anything moves."""
        return (
            self.mode in ("holding", "fault")
            and CAUSES[self.cause].resumes == "after acknowledgement"
        )

    @property
    def may_move(self) -> bool:
        """Whether a good chunk would be followed."""
        return self.mode in ("armed", "moving") or (
            self.mode == "holding" and not self.needs_acknowledgement
        )

    def check(self, command: Command, now: int) -> None:
        """Raises Rejected when a command is not for this gateway, or late."""
        if command.boot != self.boot:
            raise Rejected(f"meant for boot {command.boot!r}, this is {self.boot!r}; look again")
        if now > command.expires:
            late = (now - command.expires) * 1e-9
            raise Rejected(f"expired {late:.3f} s ago; nothing was done")

    def armed(self, obstacle: str = "") -> Safety:
        """After a person arms.

        Args:
            obstacle: What keeps the cell from being armed, in words.
        """
        if self.may_move:
            raise Rejected(f"armed already ({self.mode}: {self.detail})")
        if self.mode != "disarmed":
            raise Rejected(f"cannot arm while {self.mode}; disarm or acknowledge first")
        if obstacle:
            raise Rejected(obstacle)
        return replace(self, mode="armed", cause="", detail="armed", session="", waiting_session="")

    def disarmed(self, detail: str = "disarmed by a person") -> Safety:
        """After a person disarms, from anywhere."""
        return replace(self, mode="disarmed", cause="disarm", detail=detail, session="")

    def acknowledged(self, obstacle: str = "") -> Safety:
        """After a person acknowledges.

        Args:
            obstacle: What is still wrong, in words.
        """
        if not self.needs_acknowledgement:
            raise Rejected(f"nothing to acknowledge while {self.mode}")
        if obstacle:
            raise Rejected(obstacle)
        # Whoever acknowledges sees the writer that is there now, or trusts the next one.
        return replace(
            self,
            mode="armed",
            cause="",
            detail="acknowledged",
            session=self.waiting_session or self.session,
            waiting_session="",
        )

    def stopped(self, cause: str, detail: str) -> Safety:
        """After something stopped the cell.

        A cause never weakens what is already required: a disarmed cell stays so, and one that
        waits for a person keeps its first reason, but a fault of a device outranks a hold.
        """
        if self.mode == "disarmed":
            return self
        mode: Mode = "fault" if cause in DEVICE_CAUSES else "holding"
        if self.mode == "fault" or (self.needs_acknowledgement and mode != "fault"):
            return self
        return replace(self, mode=mode, cause=cause, detail=detail)

    def written(self, session: str) -> Safety:
        """After a chunk or hold of a writer arrived; a new one holds the cell."""
        if session in (self.session, self.waiting_session) or self.mode == "disarmed":
            return self
        if not self.session:
            return replace(self, session=session)
        held = self.stopped("new_writer", f"writer {session!r} replaces {self.session!r}")
        return replace(held, waiting_session=session)

    def moving(self, moves: bool) -> Safety:
        """While a chunk is followed, and when it is over."""
        if moves and self.may_move and self.mode != "moving":
            return replace(self, mode="moving", cause="", detail="following setpoints")
        if not moves and self.mode == "moving":
            return replace(self, mode="armed", cause="", detail="at rest")
        return self
