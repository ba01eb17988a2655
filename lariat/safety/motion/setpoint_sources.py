"""Sources of setpoints: one writer session at a time, in sequence, on the writer's own clock.

Session and sequence number stand on a public bus. So an unknown publisher that speaks beside the
followed writer is refused, only a message that is followed advances the sequence, and a far jump
counts only when the writer has been silent: nobody can run the sequence far ahead of the writer.
"""

from __future__ import annotations

from lariat.safety.guard.state_machine import SafetyState
from lariat.safety.motion.validation import ChunkRefused
from lariat.trajectory import NANOSECONDS

SAME_CLOCK_TOLERANCE = 0.25
"""Age of a first message, either way, up to which its clock counts as the gateway's [s]."""
MAX_SEQUENCE_STEP = 50
"""Largest step of the sequence number while the writer speaks: 1 s of its messages."""
SEQUENCE_SILENCE = 0.1
"""Silence of a writer after which its sequence may begin anywhere [s]."""
WRITER_SILENCE = 0.5
"""Silence of the followed writer after which another one may replace it [s]."""
MAX_WRITERS = 64
"""Most writers whose last message is remembered."""


class SetpointSources:
    """Session, sequence number and clock offset of the writer that is followed."""

    def __init__(self) -> None:
        self._session = ""
        self._sequence = -1
        self._accepted = 0
        """Time of the last message that was accepted [ns]."""
        self._clock_session = ""
        """Session of the writer whose clock is known."""
        self._offset = 0
        self._heard: dict[str, int] = {}
        """Time of the last message of each writer [ns]."""

    def admit(
        self, safety: SafetyState, session: str, sequence: int, now: int, start: int
    ) -> tuple[SafetyState, int | ChunkRefused]:
        """Admit or refuse a message of a writer, which `accept` counts if it is followed.

        Args:
            safety: State of the cell.
            session: Session of the writer.
            sequence: Sequence number of the message within the session.
            now: Time of receipt [ns].
            start: Time of the message by the clock of the writer [ns].

        Returns:
            The cell's state after that, and the offset from the writer's clock to the gateway's
            [ns] or the refusal by rule `ordered`.
        """
        if not session:
            return safety, ChunkRefused("ordered", "the writer gives no session")
        self._note(session, now)
        followed = safety.session
        if followed not in ("", session) and self._speaks(followed, now, WRITER_SILENCE):
            words = f"writer {session!r} speaks beside {followed!r}, which is followed; end one"
            return safety, ChunkRefused("ordered", words)
        safety = safety.with_writer(session)
        if safety.session not in ("", session):
            words = f"writer {session!r} is not the one that is followed"
            return safety, ChunkRefused("ordered", words)
        try:
            self.check_sequence(session, sequence, now)
        except ChunkRefused as refused:
            return safety, refused
        return safety, self._offset_of(session, now, start)

    def check_sequence(self, session: str, sequence: int, now: int) -> None:
        """Check that a message comes after the last one of its session that was accepted.

        Args:
            session: Session of the writer.
            sequence: Sequence number of the message.
            now: Present time [ns].

        Raises:
            ChunkRefused: By rule `ordered`.
        """
        step = sequence - self._sequence
        if self._session != session or 0 < step <= MAX_SEQUENCE_STEP:
            return
        silent = (now - self._accepted) * NANOSECONDS > SEQUENCE_SILENCE
        if abs(step) <= MAX_SEQUENCE_STEP or not silent:
            raise ChunkRefused("ordered", f"sequence {sequence} after {self._sequence}")

    def accept(self, session: str, sequence: int, now: int, offset: int | None = None) -> None:
        """Count an admitted message, so that earlier ones of its session are refused.

        Args:
            session: Session of the writer.
            sequence: Sequence number of the message.
            now: Time of receipt [ns].
            offset: Offset of the writer's clock, as admitted, by which its later messages are
                judged [ns]; None for a message that has no time.
        """
        self._session, self._sequence, self._accepted = session, sequence, now
        if offset is not None:
            self._clock_session, self._offset = session, offset

    def writers(self, now: int) -> list[str]:
        """Return the sessions of the writers that speak, sorted. Args: now: Present time [ns]."""
        return sorted(s for s in self._heard if self._speaks(s, now, WRITER_SILENCE))

    def competing_publishers(self, now: int) -> str:
        """Return which writers speak at once, in words; empty where at most one does.

        Args:
            now: Present time [ns].
        """
        writers = self.writers(now)
        return f"writers {' and '.join(writers)} speak at once; end one" if len(writers) > 1 else ""

    def _offset_of(self, session: str, now: int, start: int) -> int:
        """Return the offset from a writer's clock to the gateway's [ns].

        The first message that is followed determines the offset of another machine's clock.
        """
        if session == self._clock_session:
            return self._offset
        difference = now - start
        return difference if abs(difference) * NANOSECONDS > SAME_CLOCK_TOLERANCE else 0

    def _speaks(self, session: str, now: int, silence: float) -> bool:
        heard = self._heard.get(session)
        return heard is not None and (now - heard) * NANOSECONDS <= silence

    def _note(self, session: str, now: int) -> None:
        self._heard.pop(session, None)
        self._heard[session] = now
        if len(self._heard) > MAX_WRITERS:
            # Whoever makes up sessions does not make the gateway forget its writer.
            del self._heard[next(s for s in self._heard if s != self._session)]
