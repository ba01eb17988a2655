"""The messages of a recording as a place in time that can be moved."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from shared.service import Inbox, Mailbox, Received
from shared.topics import Topic


class Moment(NamedTuple):
    """One recorded message."""

    key: str
    payload: bytes
    publisher: str
    sequence: int
    time: int
    """Of its receipt [ns]."""


class Timeline:
    """What a reader of some topics would know at any time of a recording."""

    def __init__(self, moments: Iterable[Moment], reads: Sequence[Topic]) -> None:
        """Args:
        moments: In order of time.
        reads: Topics that the reader reads; moments of others are left out.

        Raises:
            ValueError: Nothing is left.
        """
        self._reads = {t.key: t for t in reads}
        self._moments = [m for m in moments if m.key in self._reads]
        if not self._moments:
            raise ValueError("no message in it is one that the dashboard shows")
        self._times = [m.time for m in self._moments]
        self._places: dict[str, list[int]] = {}
        for place, moment in enumerate(self._moments):
            self._places.setdefault(moment.key, []).append(place)
        self.start = self._times[0]
        """[ns]"""
        self.end = self._times[-1]
        """[ns]"""
        self._next = 0
        self._mailbox = Mailbox(reads)

    def advance(self, now: int) -> Inbox:
        """What a reader finds that was last here before, and comes again at `now` [ns]."""
        while self._next < len(self._moments) and self._times[self._next] <= now:
            self._deliver(self._moments[self._next])
            self._next += 1
        return self._mailbox.take()

    def jump(self, now: int) -> Inbox:
        """What a reader finds that comes here for the first time: each topic's newest message."""
        self._mailbox = Mailbox(self._reads.values())
        self._next = bisect_right(self._times, now)
        for places in self._places.values():
            count = bisect_right(places, self._next - 1)
            if count:
                self._deliver(self._moments[places[count - 1]])
        return self._mailbox.take()

    def past(self, topic: Topic, now: int) -> Iterator[Any]:
        """All messages of one topic up to `now` [ns]."""
        for place in self._places.get(topic.key, ()):
            moment = self._moments[place]
            if moment.time > now:
                return
            yield topic.type.FromString(moment.payload)

    def _deliver(self, moment: Moment) -> None:
        message = self._reads[moment.key].type.FromString(moment.payload)
        received = Received(message, moment.publisher, moment.sequence, moment.time)
        self._mailbox.deliver(moment.key, received)


def thinned(moments: Iterable[Moment], key: str, period: int) -> Iterator[Moment]:
    """Leaves out messages of one topic that follow another within `period` [ns]."""
    last = None
    for moment in moments:
        if moment.key == key:
            if last is not None and moment.time - last < period:
                continue
            last = moment.time
        yield moment
