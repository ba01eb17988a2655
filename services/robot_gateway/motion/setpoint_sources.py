"""Sources of setpoints: one writer session at a time, in sequence, on the writer's own clock."""

from __future__ import annotations

from lariat.trajectory import NANOSECONDS
from services.robot_gateway.motion.validation import ChunkRefused
from services.robot_gateway.safety.state_machine import SafetyState

SAME_CLOCK_TOLERANCE = 0.25
"""Age of a first message, either way, up to which its clock counts as the gateway's [s]."""


class SetpointSources:
    """Session, sequence number and clock offset of the writer that is followed."""

    def __init__(self) -> None:
        self._session = ""
        self._sequence = -1
        self._offset = 0

    def admit(
        self, safety: SafetyState, session: str, sequence: int, now: int, start: int
    ) -> tuple[SafetyState, int | ChunkRefused]:
        """Admit or refuse a message of a writer.

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
        safety = safety.with_writer(session)
        if safety.session not in ("", session):
            followed = f"writer {session!r} is not the one that is followed"
            return safety, ChunkRefused("ordered", followed)
        if self._session != session:
            # The first message determines the offset of another machine's clock.
            difference = now - start
            far = abs(difference) * NANOSECONDS > SAME_CLOCK_TOLERANCE
            self._offset = difference if far else 0
        elif sequence <= self._sequence:
            refused = ChunkRefused("ordered", f"sequence {sequence} after {self._sequence}")
            return safety, refused
        self._session, self._sequence = session, sequence
        return safety, self._offset
