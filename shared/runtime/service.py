"""Contract of a service: a `step` from an inbox of messages to publications.

A service is a class with the members of `Service`. It only computes: a step opens no socket, reads
no clock, does not sleep and changes no global state. Its outputs depend only on the arguments of
its constructor, the messages in its inboxes and the times of its steps, so that the same code runs
* in real time on the bus (`shared.runtime.live`),
* in simulated time, all services in one process (`stack.simulation.simulated_time`),
* from a recording, to compare its outputs (`stack.replay`).

Its runner collects arriving messages in a `Mailbox` and passes an `Inbox` to each step. A minimal
service:

    class TruthPerception:
        name = "perception"
        reads = (topics.ROPE_TRUTH,)
        writes = (topics.ROPE_NODES,)
        rate = 30.0
        latency = 0.02

        def warm_up(self) -> None:
            pass

        def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
            rope = inbox.fresh(topics.ROPE_TRUTH)
            if rope is not None:
                yield Publication(topics.ROPE_NODES, rope.message)

A service lives in `services/NAME/service.py`, beside a function `build(scenario, session)` that
creates it; `session` is the id of this start of the process.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from shared.messages import TraceInput, stamp_of
from shared.topics import Buffering, Topic

SECOND = 1_000_000_000
"""Duration of a second [ns]."""
MAX_PARTIAL_SETS = 8
"""Number of incomplete sets of `joined` messages that a mailbox keeps."""


class Publication(NamedTuple):
    """A message and the topic on which to publish it."""

    topic: Topic
    """Topic in the service's `writes`."""
    message: Any
    """Message of the topic's type."""


class Received(NamedTuple):
    """A message with its origin and the time of its receipt."""

    message: Any
    """Message of the topic's type; must not be changed, later inboxes hold it as well."""
    publisher: str
    """Id of the process start that sent it, e.g. `controller-1f2e3d4c`."""
    sequence: int
    """Number among the publisher's messages on this topic, from 0."""
    received: int
    """Time of receipt on the receiver's clock [ns]. The age of a message is judged by it, never by
    the clock of another machine."""


class Service(Protocol):
    """Members that every service has.

    `shared.runtime.live` lists the optional ones.
    """

    name: str
    """Name of its folder, unique in the cell; part of its topics `health/…`, `trace/…`, `log/…`."""
    reads: Sequence[Topic]
    """Topics of its inbox; its own messages are not delivered to it."""
    writes: Sequence[Topic]
    """Topics on which it publishes, beside its health, trace and log."""
    rate: float
    """Steps per second [Hz]."""
    latency: float
    """Time between a step and the delivery of its publications, in simulated time only [s]."""

    def warm_up(self) -> None:
        """Compile and allocate what the first step needs; called once before it."""
        ...

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Process the messages since the last step and yield the publications.

        The runner always exhausts the iterator before the next step. Input that is missing or stale
        is no error: the service publishes a state that says so. An exception ends the process;
        the handling of what others send stands in a door (`shared.door`).

        Args:
            inbox: Messages since the last step, and the newest message of each topic.
            now: Time of this step on the service's clock [ns]; grows with each step.
        """
        ...


class Reflex(Protocol):
    """Answer of a service to one topic between its steps, for what may not wait for a step.

    Its methods are called in the bus's thread and in threads of the service.
    """

    reads: Topic
    """Topic that it takes."""
    writes: Topic
    """Topic of the service's `writes` on which it publishes."""

    @property
    def waits(self) -> bool:
        """Whether messages are taken now; those that come meanwhile are not decoded."""
        ...

    def connect(self, send: Callable[[Any], None]) -> None:
        """Take the function that stamps a message and publishes it at once."""
        ...

    def take(self, message: Any) -> None:
        """Take a message of the topic as it arrives."""
        ...


class Inbox:
    """Input of one step: the messages since the last step, and the newest one of each topic.

    The method fits the buffering of the topic, see `shared.topics.Topic.buffering`. A topic with a
    placeholder is read by its concrete key, `inbox.latest(topics.HEALTH.at("sim"))`.
    """

    def __init__(
        self,
        newest: Mapping[str, Received],
        arrived: Mapping[str, Sequence[Received]],
    ) -> None:
        """Create an inbox; services get theirs from a `Mailbox`."""
        self._newest = newest
        self._arrived = arrived

    def latest(self, topic: Topic) -> Received | None:
        """Return the newest message of a topic, however old; None before the first."""
        return self._newest.get(topic.key)

    def fresh(self, topic: Topic) -> Received | None:
        """Return the newest message of a topic if it arrived since the last step, else None."""
        arrived = self._arrived.get(topic.key)
        return arrived[-1] if arrived else None

    def every(self, topic: Topic) -> Sequence[Received]:
        """Return all messages of an `every` topic since the last step, in order of arrival."""
        return self._arrived.get(topic.key, ())

    def joined(self, *topics: Topic) -> tuple[Received, ...] | None:
        """Return the newest messages of `joined` topics that have the same stamp.

        Returns:
            One message per topic, in the given order, if such a set was completed since the last
            step; else None.
        """
        rows = [self._arrived.get(topic.key) for topic in topics]
        return tuple(row[-1] for row in rows if row) if all(rows) else None

    @property
    def consumed(self) -> Iterator[TraceInput]:
        """Origin of every message that arrived since the last step, for the step's trace."""
        for key, arrived in self._arrived.items():
            for item in arrived:
                yield TraceInput(
                    topic=key,
                    publisher=item.publisher,
                    sequence=item.sequence,
                    received=item.received,
                )


class Mailbox:
    """Collector of the messages that arrive between two steps of one service.

    Runners use it: they `deliver` messages at any time and `take` the inbox of each step.
    """

    def __init__(self, reads: Iterable[Topic]) -> None:
        """Create an empty mailbox.

        Args:
            reads: Topics that the service reads; those with buffering `joined` whose keys differ
                in the last part only form one set, e.g. the images of one camera.
        """
        self._topics = {topic.key: topic for topic in reads}
        self._sets: dict[str, _JoinedSet] = {}
        for key in (t.key for t in self._topics.values() if t.buffering == "joined"):
            self._sets.setdefault(_set_name(key), _JoinedSet()).keys.append(key)
        self._newest: dict[str, Received] = {}
        self._arrived: dict[str, list[Received]] = defaultdict(list)
        self.drops = 0
        """Messages of `latest` and `joined` topics that were replaced or discarded unread."""

    def deliver(self, key: str, item: Received) -> None:
        """Add one message."""
        match self._buffering(key):
            case "latest":
                self.drops += len(self._arrived[key])
                self._arrived[key] = [item]
                self._newest[key] = item
            case "every":
                self._arrived[key].append(item)
                self._newest[key] = item
            case "joined":
                self._join(key, item)

    def take(self) -> Inbox:
        """Return the inbox of the next step, and start to collect for the one after it."""
        arrived = {k: tuple(v) for k, v in self._arrived.items() if v}
        self._arrived.clear()
        return Inbox(dict(self._newest), arrived)

    def _buffering(self, key: str) -> Buffering:
        if key in self._topics:
            return self._topics[key].buffering
        return next(t.buffering for t in self._topics.values() if t.matches(key))

    def _join(self, key: str, item: Received) -> None:
        joined, stamp = self._sets[_set_name(key)], stamp_of(item.message)
        publisher, last = joined.last
        if item.publisher == publisher and stamp <= last:
            # A set that is completed after a newer one would take its reader back in time.
            self.drops += 1
            return
        parts = joined.partial.setdefault(stamp, {})
        parts[key] = item
        if len(parts) == len(joined.keys):
            for name in joined.keys:
                self.drops += len(self._arrived[name])
                self._arrived[name] = [parts[name]]
                self._newest[name] = parts[name]
            joined.last = (item.publisher, stamp)
            joined.partial = {s: p for s, p in joined.partial.items() if s > stamp}
        while len(joined.partial) > MAX_PARTIAL_SETS:
            self.drops += 1
            del joined.partial[min(joined.partial)]


@dataclass
class _JoinedSet:
    """Topics whose messages of one stamp are taken together."""

    keys: list[str] = field(default_factory=list)
    """Keys of the topics."""
    partial: dict[int, dict[str, Received]] = field(default_factory=dict)
    """Messages of incomplete sets by stamp [ns] and key."""
    last: tuple[str, int] = ("", 0)
    """Publisher and stamp [ns] of the newest complete set."""


def _set_name(key: str) -> str:
    return key.rpartition("/")[0]
