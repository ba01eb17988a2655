"""The contract of a service: a step from inbox to publications, and nothing else.

A step opens no socket, reads no clock, sleeps never and keeps no global. What drives it is a
runner: `shared.live` over Zenoh in real time, `stack.simulation.simulated_time` in one process, or
`cli.replay` from a recording.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from shared.messages import Message, TraceInput, stamp_of
from shared.topics import Hold, Topic

SECOND = 1_000_000_000
"""Nanoseconds."""


class Publication(NamedTuple):
    """One message for one topic."""

    topic: Topic
    message: Message


@dataclass(frozen=True)
class Received:
    """A message as it reached a service."""

    message: Any
    publisher: str
    """Id of the process start that sent it."""
    sequence: int
    """Its number among the publisher's messages on this topic, from 0."""
    received: int
    """Local receipt time [ns]; freshness is judged by it, never by another machine's clock."""


class Service(Protocol):
    """What every service is."""

    name: str
    reads: Sequence[Topic]
    writes: Sequence[Topic]
    rate: float
    """Steps a second."""
    latency: float
    """Simulated time: outputs become visible this long after the inputs were taken [s]."""

    def warm_up(self) -> None:
        """Compiles and allocates everything that a first step would otherwise wait for."""
        ...

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """One step at `now` [ns]."""
        ...


class Inbox:
    """What arrived since the step before, and the newest state of every topic."""

    def __init__(
        self,
        newest: Mapping[str, Received],
        arrived: Mapping[str, Sequence[Received]],
    ) -> None:
        self._newest = newest
        self._arrived = arrived

    def latest(self, topic: Topic) -> Received | None:
        """The newest message of a `latest` topic, whenever it came; None before the first."""
        return self._newest.get(topic.key)

    def fresh(self, topic: Topic) -> Received | None:
        """The newest message of a topic when it came since the step before, else None."""
        arrived = self._arrived.get(topic.key)
        return arrived[-1] if arrived else None

    def every(self, topic: Topic) -> Sequence[Received]:
        """All messages of an `every` topic since the step before, in their order of arrival."""
        return self._arrived.get(topic.key, ())

    def joined(self, *topics: Topic) -> tuple[Received, ...] | None:
        """The newest set of `joined` topics with one stamp, when it became whole since the step
        before."""
        rows = [self._arrived.get(topic.key) for topic in topics]
        return tuple(row[-1] for row in rows if row) if all(rows) else None

    @property
    def consumed(self) -> Iterator[TraceInput]:
        """What this step was given, for its trace."""
        for key, arrived in self._arrived.items():
            for item in arrived:
                yield TraceInput(
                    topic=key,
                    publisher=item.publisher,
                    sequence=item.sequence,
                    received=item.received,
                )


class Mailbox:
    """Collects deliveries between the steps of one service, as each topic says."""

    def __init__(self, reads: Iterable[Topic]) -> None:
        self._topics = {topic.key: topic for topic in reads}
        self._joined = [t.key for t in self._topics.values() if t.hold == "joined"]
        self._newest: dict[str, Received] = {}
        self._arrived: dict[str, list[Received]] = defaultdict(list)
        self._partial: dict[int, dict[str, Received]] = {}
        self._last_joined = ("", 0)
        self.drops = 0
        """Messages of `latest` and `joined` topics that a newer one replaced unread."""

    def deliver(self, key: str, item: Received) -> None:
        """Takes one message of a topic that the service reads; `key` fills its placeholder."""
        match self._hold(key):
            case "latest":
                self.drops += len(self._arrived[key])
                self._arrived[key] = [item]
                self._newest[key] = item
            case "every":
                self._arrived[key].append(item)
                self._newest[key] = item
            case "joined":
                self._join(key, item)

    def _hold(self, key: str) -> Hold:
        if key in self._topics:
            return self._topics[key].hold
        return next(t.hold for t in self._topics.values() if t.matches(key))

    def _join(self, key: str, item: Received) -> None:
        stamp = stamp_of(item.message)
        publisher, last = self._last_joined
        if item.publisher == publisher and stamp <= last:
            # A set that becomes whole after a newer one would take its reader back in time.
            self.drops += 1
            return
        parts = self._partial.setdefault(stamp, {})
        parts[key] = item
        if len(parts) == len(self._joined):
            for name in self._joined:
                self.drops += len(self._arrived[name])
                self._arrived[name] = [parts[name]]
                self._newest[name] = parts[name]
            self._last_joined = (item.publisher, stamp)
            self._partial = {s: p for s, p in self._partial.items() if s > stamp}
        while len(self._partial) > 8:
            self.drops += 1
            del self._partial[min(self._partial)]

    def take(self) -> Inbox:
        """The inbox of the next step."""
        arrived = {k: tuple(v) for k, v in self._arrived.items() if v}
        self._arrived.clear()
        return Inbox(dict(self._newest), arrived)
