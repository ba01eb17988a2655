"""Which writer's setpoints count: one session at a time, in their order, on its own clock."""

from __future__ import annotations

from lariat.trajectory import NANOSECONDS
from services.robot_gateway.motion.validation import Refused
from services.robot_gateway.safety.state_machine import Safety

CLOCK_ERROR = 0.25
"""A first chunk further from the present than this comes from another clock [s]."""


class Writers:
    """Sessions, sequence numbers and clocks of those who write."""

    def __init__(self) -> None:
        self._numbers: tuple[str, int, int] = ("", -1, 0)

    def take(
        self, safety: Safety, session: str, sequence: int, now: int, start: int
    ) -> tuple[Safety, int | Refused]:
        """Lets a writer in, or not.

        Args:
            start: The writer's present time [ns], by its own clock.

        Returns:
            The cell's state after that, and the offset from the writer's clock to ours [ns] or the
            rule that it breaks.
        """
        if not session:
            return safety, Refused("ordered", "the writer gives no session")
        safety = safety.written(session)
        if safety.session not in ("", session):
            return safety, Refused("ordered", f"writer {session!r} is not the one that is followed")
        known, last, offset = self._numbers
        if known != session:
            # Another machine's clock: its first message says how far it is off.
            apart = now - start
            offset = apart if abs(apart) * NANOSECONDS > CLOCK_ERROR else 0
        elif sequence <= last:
            return safety, Refused("ordered", f"sequence {sequence} after {last}")
        self._numbers = (session, sequence, offset)
        return safety, offset
