"""State machine of a cell: whether anything may move.

It depends on neither geometry nor devices. The rows of `stop_causes.py` state for each cause the
condition for moving again. At boot a cell is disarmed. Only a person's command leaves a state that
requires one: an acknowledgement confirms a stop and moves nothing, after it the cell stands until
the person resumes. `operator_commands.py` checks commands before they come here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from lariat.safety.guard.operator_commands import CommandRejected
from lariat.safety.guard.stop_causes import STOP_CAUSES, Resumption

Mode = Literal["disarmed", "armed", "moving", "holding", "fault"]

DEVICE_CAUSES = ("alarm", "lost_link")
"""Causes from which a device must also recover."""
PERSISTENCE: dict[Resumption, int] = {
    "by itself": 0,
    "after resuming": 1,
    "after an approach": 1,
    "after acknowledgement": 2,
    "after arming": 3,
}
"""Rank of the conditions for moving again: a stop never weakens the one that holds."""


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
    approach_unfinished: bool = False
    """Whether an approach has begun that has not arrived at the start."""

    @property
    def resumes(self) -> Resumption:
        """Condition for moving again.

        Arms that a stop has left on their way to the start go on by another approach only, also
        where others would go on by themselves.
        """
        resumes = STOP_CAUSES[self.cause].resumes if self.cause else "by itself"
        unfinished = self.approach_unfinished and self._held and resumes == "by itself"
        return "after an approach" if unfinished else resumes

    @property
    def needs_acknowledgement(self) -> bool:
        """Whether a person must acknowledge, and resume, before anything moves."""
        return self._held and self.resumes == "after acknowledgement"

    @property
    def needs_resume(self) -> bool:
        """Whether a stop is acknowledged and a person must resume before anything moves."""
        return self._held and self.resumes == "after resuming"

    @property
    def needs_approach(self) -> bool:
        """Whether an approach has stopped on its way and only another one may go on."""
        return self._held and self.resumes == "after an approach"

    @property
    def may_move(self) -> bool:
        """Whether a valid chunk would be followed."""
        return self.mode in ("armed", "moving") or (self._held and self.resumes == "by itself")

    @property
    def next_session(self) -> str:
        """Session of the writer that an acknowledgement accepts; empty: the next one."""
        return self.waiting_session or self.session

    @property
    def _held(self) -> bool:
        return self.mode in ("holding", "fault")

    # Commands of a person

    def armed(self, session: str = "") -> SafetyState:
        """Return the state after a person arms.

        Args:
            session: Writer that the person accepts; empty: the next one.

        Raises:
            CommandRejected: The cell is not disarmed.
        """
        if self.may_move:
            raise CommandRejected(f"armed already ({self.mode}: {self.detail})")
        if self.mode != "disarmed":
            raise CommandRejected(f"cannot arm while {self.mode}; disarm or acknowledge first")
        return self._free("armed", session)

    def approaching(self, session: str = "") -> SafetyState:
        """Return the state after a person has consented to an approach.

        Args:
            session: Writer that the person accepts; empty: the next one.

        Raises:
            CommandRejected: The cell is neither disarmed nor stopped in an approach.
        """
        if self.mode != "disarmed" and not self.needs_approach:
            raise CommandRejected(f"an approach begins while disarmed, not while {self.mode}")
        freed = self._free("approaching the start", session)
        return replace(freed, approach_unfinished=True)

    def disarmed(self, detail: str = "disarmed by a person") -> SafetyState:
        """Return the state after a person disarms, from any state."""
        return SafetyState(self.boot, "disarmed", "disarm", detail)

    def acknowledged(self) -> SafetyState:
        """Return the state after a person acknowledges: the cell stands until it is resumed.

        After a stop of an approach it stands until another approach goes on.

        Raises:
            CommandRejected: There is nothing to acknowledge.
        """
        if not self.needs_acknowledgement:
            raise CommandRejected(f"nothing to acknowledge while {self.mode}: {self.detail}")
        left, hint = "acknowledged", "stands until it is resumed"
        if self.approach_unfinished:
            left, hint = "unfinished_approach", "another approach to the start goes on"
        return replace(
            self,
            mode="holding",
            cause=left,
            detail=f"acknowledged ({self.detail}); {hint}",
            session=self.next_session,
            waiting_session="",
        )

    def resumed(self) -> SafetyState:
        """Return the state after a person resumes.

        Raises:
            CommandRejected: Nothing has been acknowledged.
        """
        if not self.needs_resume:
            hint = "; acknowledge first" if self.needs_acknowledgement else ""
            hint = "; approach the start" if self.needs_approach else hint
            raise CommandRejected(f"nothing to resume while {self.mode}{hint}")
        return self._free("resumed", self.session)

    # Events

    def stopped(self, cause: str, detail: str) -> SafetyState:
        """Return the state after something stopped the cell.

        A cause never weakens the condition for moving again: a disarmed cell stays disarmed, and
        one that waits for a person keeps its first cause, except that a fault outranks a hold.

        Args:
            cause: Row of `STOP_CAUSES`.
            detail: The cause in words, with numbers.
        """
        if self.mode in ("disarmed", "fault"):
            return self
        mode: Mode = "fault" if cause in DEVICE_CAUSES else "holding"
        present = PERSISTENCE[self.resumes]
        if mode != "fault" and present and PERSISTENCE[STOP_CAUSES[cause].resumes] <= present:
            return self
        return replace(self, mode=mode, cause=cause, detail=detail)

    def with_writer(self, session: str) -> SafetyState:
        """Return the state after a message of a writer; a new writer holds the cell."""
        if session in (self.session, self.waiting_session) or self.mode == "disarmed":
            return self
        if not self.session:
            return replace(self, session=session)
        stopped = self.stopped("new_writer", f"writer {session!r} replaces {self.session!r}")
        return replace(stopped, waiting_session=session)

    def moving(self, moves: bool) -> SafetyState:
        """Return the state while a chunk is followed (True), or once the command rests (False)."""
        if moves and self.may_move and self.mode != "moving":
            return replace(self, mode="moving", cause="", detail="following setpoints")
        if not moves and self.mode == "moving":
            return replace(
                self, mode="armed", cause="", detail="at rest", approach_unfinished=False
            )
        return self

    def _free(self, detail: str, session: str) -> SafetyState:
        return SafetyState(self.boot, "armed", "", detail, session)
