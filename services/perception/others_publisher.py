"""Ropes beside the held one as messages."""

from __future__ import annotations

from collections.abc import Iterator

from services.perception.centerline.estimate import MAX_DOUBT, CenterlineEstimate
from services.perception.tracking.other_ropes import FollowedRope, OtherRopes, SeesPast
from shared import messages, topics
from shared.service import SECOND, Publication


class OthersPublisher:
    """Follows the ropes beside the held one, and publishes them."""

    def __init__(self, diameter: float) -> None:
        """
        Args:
            diameter: Diameter of the held rope, which others of its colour are taken to have [m].
        """
        self._diameter = diameter
        self._others = OtherRopes()
        self._published = -SECOND

    def forget(self) -> None:
        """Drop all ropes."""
        self._others.forget()

    def publications(
        self, estimate: CenterlineEstimate, sees_past: SeesPast, stamp: int, now: int
    ) -> Iterator[Publication]:
        """Yield the ropes, while there are any and once a second.

        Args:
            estimate: Estimate of the held rope; the others beside a doubtful one do not count.
            sees_past: Function that tells for points whether a camera sees something behind them.
            stamp: Time of the exposure [ns].
            now: Present time [ns].
        """
        others, before = self._others, self._others.revision
        sure = not estimate.lost and estimate.doubt < MAX_DOUBT
        others.update([o.points for o in estimate.others if sure], sees_past, stamp)
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
            diameter=self._diameter,
        )
