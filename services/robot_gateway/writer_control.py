"""Control of writers: whose setpoints are followed, and when they have been checked.

Of the chunks that arrive in a tick, the newest one that keeps every rule is followed, unless the
cell has stopped meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from lariat.safety.guard.watchdog import Watchdog
from lariat.safety.motion.follower import SetpointFollower
from lariat.safety.motion.setpoint_sources import SetpointSources
from lariat.safety.motion.validation import ChunkRefused, check_length
from lariat.trajectory import SetpointChunk
from services.robot_gateway.stop_control import StopControl

MAX_WAITING_CHUNKS = 2
"""Chunks of a tick that are kept: the newest one, and the one before it if that is refused."""


@dataclass(frozen=True)
class WriterChunk:
    """Setpoints as a writer sent them."""

    chunk: SetpointChunk
    """Setpoints of the driven ends."""
    session: str
    """Session of the writer."""
    sequence: int
    """Sequence number within the session."""
    received: int
    """Time of receipt [ns]."""


@dataclass(frozen=True)
class Candidate:
    """Chunk of the followed writer that waits for the tick's check."""

    message: WriterChunk
    """The setpoints as they were sent."""
    offset: int
    """Offset from the clock of the writer to that of the gateway [ns]."""
    stops: int
    """Number of stops of the command before they arrived."""


class WriterControl:
    """Admission and check of the setpoints of writers."""

    def __init__(
        self,
        follower: SetpointFollower,
        control: StopControl,
        watchdog: Watchdog,
        listening: Callable[[], bool],
    ) -> None:
        """Create the control without a writer; one moves the arms while `listening` says so."""
        self._follower = follower
        self._control = control
        self._watchdog = watchdog
        self._listening = listening
        self._sources = SetpointSources()
        self._waiting: list[Candidate] = []
        """Chunks that wait for the tick's check, the newest one first."""
        self._session = ""
        """Session of the writer whose messages are numbered below."""
        self.sequence = 0
        """Sequence number of the message that was accepted last."""
        self.refused_sequence = 0
        """Sequence number of the chunk that was refused last; 0 where none was since a person
        permitted motion."""
        self.refusal = ""
        """Reason for the last refusal."""

    def take_hold(self, session: str, sequence: int, now: int) -> bool:
        """Take a writer's message that it holds on purpose, and return whether it counts."""
        try:
            self._admit(session, sequence, now, now)
        except ChunkRefused as refused:
            self._refuse(refused, None)
            return False
        self._sources.accept(session, sequence, now)
        self._watchdog.feed(now)
        self.sequence = sequence
        # What it sent before is not what it wants any more.
        self._waiting = []
        return True

    def take_chunks(self, arrived: Iterable[WriterChunk]) -> None:
        """Take the chunks of a tick, the newest one first; a few of them wait for their check."""
        taken: list[Candidate] = []
        looked_at = 0
        for message in arrived:
            try:
                candidate = self._candidate(message)
            except ChunkRefused as refused:
                # Who is not followed does not report refusals to the writer who is.
                unknown = refused.rule == "ordered"
                self._refuse(refused, None if unknown else message.sequence)
                if refused.rule not in ("ordered", "fresh"):
                    # The writer is alive: the chunk before may run to its resting end.
                    self._watchdog.feed(message.received)
                # Strangers and old messages are refused before their content is looked at.
                looked_at += not unknown
            else:
                looked_at += 1
                taken += [candidate] if candidate else []
            if looked_at == MAX_WAITING_CHUNKS:
                break
        self._waiting = taken

    def advance(self, now: int) -> None:
        """Check the chunks that wait at `now` [ns], and follow the newest one that passes."""
        waiting, self._waiting = self._waiting, []
        for candidate in waiting:
            if self._listening() and candidate.stops == self._follower.stops:
                try:
                    self._follow(candidate, now)
                    return
                except ChunkRefused as refused:
                    sequence = None if refused.rule == "ordered" else candidate.message.sequence
                    self._refuse(refused, sequence)

    def forget_refusal(self) -> None:
        """Forget the last refusal, after a person has permitted motion."""
        self.refused_sequence, self.refusal = 0, ""

    def note_refusal(self, refused: ChunkRefused) -> None:
        """Note that a motion which no writer asked for was refused."""
        self._refuse(refused, None)

    def next_session(self, now: int) -> str:
        """Return the session of the writer that arming or an acknowledgement would accept."""
        if self._control.safety.mode != "disarmed":
            return self._control.safety.next_session
        writers = self._sources.writers(now)
        return writers[0] if len(writers) == 1 else ""

    def competing_publishers(self, now: int) -> str:
        """Return which writers speak at once, in words; empty where at most one does."""
        return self._sources.competing_publishers(now)

    def _candidate(self, message: WriterChunk) -> Candidate | None:
        """Return a chunk that waits for its check; None while nothing is followed.

        Refuses by rule `ordered`, `finite`, `fresh` or `rest`.
        """
        chunk, now = message.chunk, message.received
        offset = self._admit(message.session, message.sequence, now, chunk.start)
        if not self._listening():
            return None
        check_length(chunk, self._follower.tolerances)
        self._follower.check_receipt(chunk, now, offset)
        self._watchdog.feed(now)
        return Candidate(message, offset, self._follower.stops)

    def _follow(self, candidate: Candidate, now: int) -> None:
        """Follow a chunk from now on [ns]."""
        message, offset = candidate.message, candidate.offset
        # A message that the bus delivers twice, or late, may have waited beside its successor.
        self._sources.check_sequence(message.session, message.sequence, now)
        spline = self._follower.check(message.chunk, now, offset)
        self._sources.accept(message.session, message.sequence, message.received, offset)
        self.sequence = message.sequence
        self._follower.follow(spline, now)
        self._control.safety = self._control.safety.moving(True)

    def _admit(self, session: str, sequence: int, now: int, start: int) -> int:
        """Return the offset from a writer's clock to the gateway's [ns]."""
        before = self._control.safety.cause
        safety, answer = self._sources.admit(self._control.safety, session, sequence, now, start)
        self._control.safety = safety
        if safety.cause == "new_writer" and before != "new_writer":
            self._follower.halt()
        if isinstance(answer, ChunkRefused):
            raise answer
        if session != self._session:
            # Another writer counts anew.
            self._session, self.sequence, self.refused_sequence = session, 0, 0
        return answer

    def _refuse(self, refused: ChunkRefused, sequence: int | None) -> None:
        self._control.rule, self.refusal = refused.rule, str(refused)
        self.refused_sequence = self.refused_sequence if sequence is None else sequence
