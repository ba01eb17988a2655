"""Subscriptions: bounded rings of unread messages, checked and decoded as they are taken."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field

import zenoh
from zenoh.handlers import RingChannel

from shared.bus.message_check import MAX_PUBLISHERS, MessageCheck, RawMessage, raw_message
from shared.bus.options import key_expression
from shared.door import Door
from shared.runtime.clock import Clock
from shared.runtime.service import Received
from shared.topics import TOPICS, Topic, find

CAPACITY = {"latest": 1, "joined": 4, "every": 512}
"""Number of unread messages that a subscription keeps, by the topic's buffering."""
WILDCARD_CAPACITY = 128
"""Number of unread messages that a subscription to several keys keeps."""
MAX_KEYS = 64
"""Most keys of a topic with a placeholder that one subscription takes, e.g. of services."""
MAX_LOSS = 1_000_000
"""Most messages that one gap in a publisher's numbers counts for: numbers can be made up."""


@dataclass
class _LossCounter:
    """Counter of the messages that are missing from publishers' sequence numbers."""

    lost: int = 0
    _next: dict[tuple[str, str], int] = field(default_factory=dict)

    def count(self, key: str, publisher: str, sequence: int) -> None:
        expected = self._next.get((key, publisher), sequence)
        self.lost += min(max(0, sequence - expected), MAX_LOSS)
        self._next[key, publisher] = sequence + 1
        if len(self._next) > MAX_PUBLISHERS:
            del self._next[next(iter(self._next))]


class _Ring:
    """Subscriber whose newest unread messages are kept."""

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        capacity: int,
        door: Door,
        own: bool,
        arrived: Callable[[], object] | None,
    ) -> None:
        origin = zenoh.Locality.ANY if own else zenoh.Locality.REMOTE
        self._capacity = capacity
        # Costs this process nothing until it takes the messages.
        subscriber = session.declare_subscriber(key, RingChannel(capacity), allowed_origin=origin)
        self._next: Callable[[], zenoh.Sample | None] = subscriber.try_recv
        self._subscriber = subscriber
        if arrived is None:
            return
        unread: deque[zenoh.Sample] = deque(maxlen=capacity)
        self._next = lambda: unread.popleft() if unread else None

        def keep() -> None:
            with suppress(zenoh.ZError):  # The session is closed.
                while True:
                    unread.append(subscriber.recv())
                    with door.guard(key):
                        arrived()

        # A callback of Zenoh's would hold up all messages of this process once 256 wait for it.
        threading.Thread(target=keep, name=f"arrivals of {key}", daemon=True).start()

    def take(self) -> Iterator[zenoh.Sample]:
        """Yield the unread messages in order of arrival, at most as many as the ring holds."""
        # Messages may arrive faster than they are read.
        for _ in range(self._capacity):
            sample = self._next()
            if sample is None:
                return
            yield sample


class _BaseSubscription:
    """Common part of subscriptions: their messages, and the counts of those that are missing."""

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        capacity: int,
        clock: Clock,
        own: bool = True,
        arrived: Callable[[], object] | None = None,
    ) -> None:
        self._check = MessageCheck()
        self._ring = _Ring(session, key, capacity, self._check.door, own, arrived)
        self._clock = clock
        self._losses = _LossCounter()

    @property
    def lost(self) -> int:
        """Number of messages that did not arrive or were overwritten before they were read."""
        return self._losses.lost

    @property
    def refused(self) -> int:
        """Number of messages dropped for their type, their version or invalid content."""
        return self._check.door.refused

    def _arrived(self) -> Iterator[RawMessage]:
        for sample in self._ring.take():
            raw = raw_message(sample, self._clock.now())
            self._losses.count(raw.key, raw.publisher, raw.sequence)
            yield raw


class RawSubscription(_BaseSubscription):
    """Subscription to all topics of the cell; messages are checked, and returned as bytes."""

    def __init__(
        self, session: zenoh.Session, clock: Clock, capacity: int, own: deque[RawMessage]
    ) -> None:
        super().__init__(session, "**", capacity, clock, own=False)
        self._own = own
        """Messages of this process, which need neither check nor transport."""
        self._topics: dict[str, Topic] = {}

    def take(self) -> Iterator[RawMessage]:
        """Yield the messages since the last call in order of arrival, this process' first."""
        for _ in range(len(self._own)):
            yield self._own.popleft()
        # One at a time: images that wait in a list would take as much memory as the ring.
        yield from (raw for raw in self._arrived() if self._is_valid(raw))

    def _is_valid(self, raw: RawMessage) -> bool:
        topic = self._topics.get(raw.key)
        if topic is None:
            try:
                topic = find(raw.key)
            except KeyError:
                self._check.door.refuse(raw.source, "no topic has this key")
                return False
            if len(self._topics) < MAX_KEYS * len(TOPICS):
                self._topics[raw.key] = topic
        return self._check.decode(topic, raw) is not None


class Subscription(_BaseSubscription):
    """Subscription to one topic, or to all keys of a topic with a placeholder; decodes messages."""

    def __init__(
        self,
        session: zenoh.Session,
        topic: Topic,
        clock: Clock,
        own: bool = True,
        arrived: Callable[[], object] | None = None,
    ) -> None:
        key = key_expression(topic.key)
        capacity = WILDCARD_CAPACITY if "*" in key else CAPACITY[topic.buffering]
        super().__init__(session, key, capacity, clock, own, arrived)
        self._topic = topic
        self._keys: set[str] = set()

    def take(self) -> list[tuple[str, Received]]:
        """Return the messages since the last call, each with its key, in order of arrival."""
        items = []
        for raw in self._arrived():
            message = self._check.decode(self._topic, raw) if self._is_known(raw) else None
            if message is not None:
                received = Received(message, raw.publisher, raw.sequence, raw.received)
                items.append((raw.key, received))
        return items

    def _is_known(self, raw: RawMessage) -> bool:
        """Whether the key is one of the first `MAX_KEYS`, whose newest messages are kept."""
        if raw.key in self._keys or len(self._keys) < MAX_KEYS:
            self._keys.add(raw.key)
            return True
        self._check.door.refuse(raw.source, f"it is more than {MAX_KEYS} keys of {self._topic.key}")
        return False
