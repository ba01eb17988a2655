"""Ropes beside the held one as messages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lariat.perception.other_ropes.other_ropes import FollowedRope, OtherRopes, SeenLine
from lariat.perception.rgbd.line_of_sight import Look
from lariat.trajectory import SECOND
from shared import messages, topics
from shared.runtime.service import Publication

HALF_LENGTH, LENGTH_POWER = 0.024, 2.2
"""Length at which a line lies beside all ropes in one of two cases [m], and power of the length by
which the odds of that fall [-]: of 24 lines below 6 cm, 6 did, of 1802 longer ones one."""


class OthersPublisher:
    """Follows the ropes beside the held one, and publishes them."""

    def __init__(self) -> None:
        self._others = OtherRopes()
        self._published = -SECOND

    def forget(self) -> None:
        """Drop all ropes."""
        self._others.forget()

    def publications(
        self, lines: Sequence[SeenLine], look: Look, stamp: int, now: int
    ) -> Iterator[Publication]:
        """Yield the ropes, while there are any and once a second."""
        others, before = self._others, self._others.revision
        others.update(lines, look, stamp)
        changed = bool(others.ropes) or others.revision != before
        if not changed and now - self._published < SECOND:
            return
        self._published = now
        ropes = [self._message(rope) for rope in others.ropes]
        message = messages.OtherRopes(stamp=stamp, revision=others.revision, ropes=ropes)
        yield Publication(topics.ROPE_OTHERS, message)

    def _message(self, rope: FollowedRope) -> messages.OtherRope:
        return messages.OtherRope(
            id=rope.id,
            lines=[
                messages.RopeLine(positions=part.points.ravel(), seen=part.seen)
                for part in rope.parts
            ],
            diameter=rope.diameter,
            p_wrong=float(1.0 / (1.0 + (rope.length / HALF_LENGTH) ** LENGTH_POWER)),
        )
