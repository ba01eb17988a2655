"""Messages of a recording, delivered as a reader of some topics would receive them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from shared.runtime.service import Inbox, Mailbox, Received
from shared.topics import Topic


class RecordedMessage(NamedTuple):
    """Recorded message."""

    key: str
    """Key of its topic."""
    payload: bytes
    """Encoded message."""
    publisher: str
    """Session id of its publisher."""
    sequence: int
    """Number of the message, counted by its publisher."""
    time: int
    """Time of receipt [ns]."""


class Timeline:
    """Inbox of a reader of some topics at any time of a recording."""

    def __init__(self, messages: Iterable[RecordedMessage], reads: Sequence[Topic]) -> None:
        self._reads = {t.key: t for t in reads}
        self._messages = [m for m in messages if m.key in self._reads]
        if not self._messages:
            raise ValueError("it holds no message that the dashboard shows")
        self._times = [m.time for m in self._messages]
        self._indices: dict[str, list[int]] = {}
        for index, message in enumerate(self._messages):
            self._indices.setdefault(message.key, []).append(index)
        self.start = self._times[0]
        """Time of the first message [ns]."""
        self.end = self._times[-1]
        """Time of the last message [ns]."""
        self._next = 0
        self._mailbox = Mailbox(reads)

    def advance(self, now: int) -> Inbox:
        """Return the inbox at `now` [ns] of a reader who took its last inbox before."""
        while self._next < len(self._messages) and self._times[self._next] <= now:
            self._deliver(self._messages[self._next])
            self._next += 1
        return self._mailbox.take()

    def jump(self, now: int) -> Inbox:
        """Return the inbox at `now` [ns] of a new reader: the newest message of each topic."""
        self._mailbox = Mailbox(self._reads.values())
        self._next = bisect_right(self._times, now)
        for indices in self._indices.values():
            count = bisect_right(indices, self._next - 1)
            if count:
                self._deliver(self._messages[indices[count - 1]])
        return self._mailbox.take()

    def past(self, topic: Topic, now: int) -> Iterator[Any]:
        """Yield all messages of a topic up to `now` [ns]."""
        for index in self._indices.get(topic.key, ()):
            message = self._messages[index]
            if message.time > now:
                return
            yield topic.type.FromString(message.payload)

    def _deliver(self, message: RecordedMessage) -> None:
        parsed = self._reads[message.key].type.FromString(message.payload)
        received = Received(parsed, message.publisher, message.sequence, message.time)
        self._mailbox.deliver(message.key, received)


def thin_topic(
    messages: Iterable[RecordedMessage], key: str, period: int
) -> Iterator[RecordedMessage]:
    """Drop messages of one topic that follow another one within a period."""
    last = None
    for message in messages:
        if message.key == key:
            if last is not None and message.time - last < period:
                continue
            last = message.time
        yield message
