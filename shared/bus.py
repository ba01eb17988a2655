"""The bus: publishers and subscriptions of topics, over Zenoh. Only this file imports zenoh.

Peers on loopback find each other by gossip through the hub in the launcher, without multicast.
Every message carries its protobuf type in the encoding; its sequence number, its publisher, the
version of the message set and the time of sending in the attachment. Messages of a newer version
are refused.

Unread messages wait in bounded ring buffers, and a publisher never waits for a reader. A message
that a slow reader loses is missing from the sequence numbers, and counted. A message larger than
its topic allows is dropped where it arrives.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import zenoh
from zenoh.handlers import RingChannel

from shared.clock import Clock, SystemClock
from shared.message_check import MAX_PUBLISHERS, MessageCheck, RawMessage
from shared.messages import Message
from shared.messages.validation import MAX_INTEGER
from shared.service import Received
from shared.topics import MAX_IMAGE_SIZE, TOPICS, Topic, find
from shared.version import MESSAGE_VERSION

DEFAULT_HUB = "tcp/127.0.0.1:7447"
"""Endpoint of the launcher's hub by default."""
_CAPACITY = {"latest": 1, "joined": 4, "every": 512}
"""Number of unread messages that a subscription keeps, by the topic's buffering."""
_WILDCARD_CAPACITY = 128
"""Number of unread messages that a subscription to several keys keeps."""
_HEADER_SIZE = 4096
"""Room for attachment and headers around the largest message of a topic [bytes]."""
MAX_KEYS = 64
"""Most keys of a topic with a placeholder that one subscription takes, e.g. of services."""
_PROTOBUF_ENCODING = "application/protobuf;"
"""Encoding of a message, before the full name of its type."""
_FROZEN_LEASE_MS = 2000
"""Time without a sign of life after which a peer counts as gone [ms]."""
_SEND_QUEUE_SIZE = 16
"""Batches that wait for the network thread, per priority: the most that Zenoh allows."""
_SECRET_SETTINGS = ("transport/auth", "transport/link/tls")
"""First part of the settings whose values are secret."""
MAX_LOSS = 1_000_000
"""Most messages that one gap in a publisher's numbers counts for: numbers can be made up."""
MAX_PUBLISHER_LENGTH = 128
"""Number of characters after which the id of a publisher is cut."""


@dataclass(frozen=True)
class BusOptions:
    """Options with which a process joins the bus."""

    namespace: str = "cell"
    """Name of the cell; cells of different names share a network without seeing each other."""
    connect: tuple[str, ...] = (DEFAULT_HUB,)
    """Zenoh endpoints to connect to, at once or as soon as they exist."""
    listen: tuple[str, ...] = ("tcp/127.0.0.1:0",)
    """Zenoh endpoints to listen on; port 0 takes any free port."""
    mode: Literal["peer", "client", "router"] = "peer"
    """Zenoh mode of this process."""
    settings: Path | None = None
    """JSON file of further Zenoh settings by their path, e.g. for TLS, users and access control:
    {"transport/auth/usrpwd/user": "controller"}."""


class BusError(ValueError):
    """The bus cannot be joined; the text is one line with the reason and the way out."""


class Unreachable(BusError):
    """No process answers at the endpoints of the bus."""


@contextmanager
def open(
    options: BusOptions, publisher: str, clock: Clock | None = None, timeout: float | None = None
) -> Iterator[Bus]:
    """Join the bus for the duration of a `with` block.

    Args:
        options: Endpoints and settings.
        publisher: Id of this start of the process, which every message carries.
        clock: Clock of the times of receipt; by default the system's.
        timeout: Longest wait for an answer at `options.connect` [s]; None does not wait: peers are
            connected whenever they appear.

    Raises:
        Unreachable: No process answered in time.
        BusError: An endpoint is taken or a setting is wrong.
    """
    try:
        session = zenoh.open(_config(options, timeout))
    except zenoh.ZError as error:
        raise _bus_error(options, str(error)) from None
    # An open session with subscribers keeps the interpreter from exiting.
    try:
        yield Bus(session, publisher, clock or SystemClock())
    finally:
        session.close()


class Publisher:
    """Publisher of one topic."""

    def __init__(self, session: zenoh.Session, topic: Topic, publisher: str, clock: Clock) -> None:
        if topic.urgent:
            priority = zenoh.Priority.REAL_TIME
        else:
            priority = zenoh.Priority.DATA_LOW if topic.large else zenoh.Priority.DATA
        # Never wait for a reader: a frozen dashboard would stop the arm's heartbeat until its
        # connection times out.
        self._publisher = session.declare_publisher(
            topic.key,
            encoding=zenoh.Encoding(_PROTOBUF_ENCODING + topic.type.DESCRIPTOR.full_name),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=priority,
            express=topic.urgent,
        )
        self._topic = topic
        self._name = publisher
        self._clock = clock
        self.sequence = 0
        """Number of the next message."""

    @property
    def has_subscribers(self) -> bool:
        """Whether any process subscribes to the topic."""
        return self._publisher.matching_status.matching

    def put(self, message: Message) -> None:
        """Send one message; it is dropped where it cannot be sent at once.

        Raises:
            TypeError: The message is not of the topic's type.
        """
        if not isinstance(message, self._topic.type):
            raise TypeError(
                f"{self._topic.key} takes {self._topic.type.DESCRIPTOR.full_name}, "
                f"not {type(message).__name__}"
            )
        payload = message.SerializeToString(deterministic=True)
        words = self.sequence, self._name, MESSAGE_VERSION, self._clock.now()
        self._publisher.put(payload, attachment=" ".join(map(str, words)))
        self.sequence += 1


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

    def __init__(self, session: zenoh.Session, key: str, capacity: int, own: bool = True) -> None:
        origin = zenoh.Locality.ANY if own else zenoh.Locality.REMOTE
        self._subscriber = session.declare_subscriber(
            key, RingChannel(capacity), allowed_origin=origin
        )
        self._capacity = capacity

    def take(self) -> Iterator[zenoh.Sample]:
        """Yield the unread messages in order of arrival, at most as many as the ring holds."""
        # Messages may arrive faster than they are read.
        for _ in range(self._capacity):
            sample = self._subscriber.try_recv()
            if sample is None:
                return
            yield sample


class _Door:
    """Common part of subscriptions: their messages, and the counts of those that are missing."""

    def __init__(
        self, session: zenoh.Session, key: str, capacity: int, clock: Clock, own: bool = True
    ) -> None:
        self._ring = _Ring(session, key, capacity, own)
        self._clock = clock
        self._losses = _LossCounter()
        self._check = MessageCheck()

    @property
    def lost(self) -> int:
        """Number of messages that did not arrive or were overwritten before they were read."""
        return self._losses.lost

    @property
    def refused(self) -> int:
        """Number of messages dropped for their type, their version or invalid content."""
        return self._check.refused

    def _arrived(self) -> Iterator[RawMessage]:
        for sample in self._ring.take():
            raw = _raw_message(sample, self._clock.now())
            self._losses.count(raw.key, raw.publisher, raw.sequence)
            yield raw


class RawSubscription(_Door):
    """Subscription to all topics of the cell; messages are checked, and returned as bytes."""

    def __init__(self, session: zenoh.Session, clock: Clock, capacity: int) -> None:
        super().__init__(session, "**", capacity, clock)
        self._topics: dict[str, Topic] = {}

    def take(self) -> list[RawMessage]:
        """Return the messages since the last call, in order of arrival."""
        return [raw for raw in self._arrived() if self._is_valid(raw)]

    def _is_valid(self, raw: RawMessage) -> bool:
        topic = self._topics.get(raw.key)
        if topic is None:
            try:
                topic = find(raw.key)
            except KeyError:
                self._check.refuse(raw, "no topic has this key")
                return False
            if len(self._topics) < MAX_KEYS * len(TOPICS):
                self._topics[raw.key] = topic
        return self._check.decode(topic, raw) is not None


class Subscription(_Door):
    """Subscription to one topic, or to all keys of a topic with a placeholder; decodes messages."""

    def __init__(
        self, session: zenoh.Session, topic: Topic, clock: Clock, own: bool = True
    ) -> None:
        key = key_expression(topic.key)
        capacity = _WILDCARD_CAPACITY if "*" in key else _CAPACITY[topic.buffering]
        super().__init__(session, key, capacity, clock, own)
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
        self._check.refuse(raw, f"it is more than {MAX_KEYS} keys of {self._topic.key}")
        return False


class Bus:
    """Connection of one process to the bus; `open` creates it."""

    def __init__(self, session: zenoh.Session, publisher: str, clock: Clock) -> None:
        self._session = session
        self._publisher = publisher
        self._clock = clock

    def publisher(self, topic: Topic) -> Publisher:
        """Return a publisher of one topic.

        Raises:
            ValueError: The topic's placeholder is not filled.
        """
        if "{" in topic.key:
            raise ValueError(f"topic {topic.key!r} has a placeholder; fill it with topic.at(name)")
        return Publisher(self._session, topic, self._publisher, self._clock)

    def subscribe(self, topic: Topic, own: bool = True) -> Subscription:
        """Return a subscription to the future messages of one topic.

        Args:
            topic: The topic.
            own: Whether messages of this process count as well.
        """
        return Subscription(self._session, topic, self._clock, own)

    def subscribe_all(self, capacity: int = 8192) -> RawSubscription:
        """Return a subscription to the future messages of all topics.

        Args:
            capacity: Number of unread messages that it keeps.
        """
        return RawSubscription(self._session, self._clock, capacity)

    def declare_alive(self, service: str) -> None:
        """List this process in `alive` for as long as it is connected."""
        # The token dies with its last reference.
        self._token = self._session.liveliness().declare_token(f"alive/{service}")

    def alive(self, timeout: float = 0.5) -> set[str]:
        """Return the names of the connected services; a frozen one is dropped after 2 s.

        Args:
            timeout: Longest wait for answers [s].
        """
        replies = self._session.liveliness().get("alive/*", timeout=timeout)
        return {str(r.ok.key_expr).removeprefix("alive/") for r in replies if r.ok is not None}


def _raw_message(sample: zenoh.Sample, received: int) -> RawMessage:
    attachment = sample.attachment.to_bytes() if sample.attachment else b""
    words = attachment.decode(errors="replace").split(" ")
    sequence, publisher, version, published = (*words, "", "", "", "")[:4]
    return RawMessage(
        key=str(sample.key_expr),
        type=str(sample.encoding).removeprefix(_PROTOBUF_ENCODING),
        payload=sample.payload.to_bytes(),
        publisher=publisher[:MAX_PUBLISHER_LENGTH],
        sequence=_integer(sequence),
        received=received,
        version=_integer(version),
        published=_integer(published),
    )


def _integer(text: str) -> int:
    """Integer of at most 19 digits that fits a message; 0 for any other text."""
    known = text.isascii() and text.isdecimal() and len(text) <= 19
    return min(int(text), MAX_INTEGER) if known else 0


def key_expression(key: str) -> str:
    """Return the Zenoh key expression of a topic's key: a placeholder becomes a wildcard."""
    start, end = key.find("{"), key.find("}")
    return key if start < 0 else f"{key[:start]}*{key[end + 1 :]}"


def _config(options: BusOptions, timeout: float | None) -> zenoh.Config:
    settings: dict[str, Any] = {
        "mode": options.mode,
        "namespace": options.namespace,
        "connect/endpoints": options.connect,
        "listen/endpoints": options.listen,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "transport/link/tx/lease": _FROZEN_LEASE_MS,
        "transport/link/rx/max_message_size": MAX_IMAGE_SIZE + _HEADER_SIZE,
        "low_pass_filter": _size_filters(options.namespace),
    }
    if timeout is not None:
        settings["connect/timeout_ms"] = int(1e3 * timeout)
        settings["connect/exit_on_failure"] = True
    # The queues must hold what is sent while the network thread waits for a core.
    for priority in ("real_time", "data", "data_low"):
        settings[f"transport/link/tx/queue/size/{priority}"] = _SEND_QUEUE_SIZE
    if options.settings:
        settings.update(_read_settings(options.settings))
    config = zenoh.Config()
    for key, value in settings.items():
        try:
            config.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            # A private key or a password must not get into a log.
            shown = "…" if key.startswith(_SECRET_SETTINGS) else json.dumps(value)
            raise BusError(f"Zenoh refuses {key} = {shown}: {error}") from None
    return config


def _size_filters(namespace: str) -> list[dict[str, Any]]:
    """Filters that drop what is larger than a message of its topic before it waits unread."""
    return [
        {
            "id": topic.key,
            "messages": ["put"],
            "flows": ["ingress"],
            "key_exprs": [f"{namespace}/{key_expression(topic.key)}"],
            "size_limit": topic.max_size + _HEADER_SIZE,
        }
        for topic in TOPICS
    ]


def _read_settings(path: Path) -> dict[str, Any]:
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BusError(f"cannot read bus settings {path}: {error}") from None
    if not isinstance(table, dict):
        raise BusError(f"bus settings {path} must be a JSON object of settings by their path")
    return table


def _bus_error(options: BusOptions, error: str) -> BusError:
    """Error in the user's terms, from the text of an error of Zenoh."""
    connect = ", ".join(options.connect)
    if "already in use" in error:
        return BusError(f"{', '.join(options.listen)} is taken; is another stack running there?")
    if "nable to connect" in error:
        hint = " (credentials that it refuses look the same)" if options.settings else ""
        return Unreachable(f"no stack answers at {connect}{hint}; is `lariat up` running?")
    return BusError(f"cannot join the bus at {connect}: {error.splitlines()[0]}")


__all__ = [
    "DEFAULT_HUB",
    "Bus",
    "BusError",
    "BusOptions",
    "Publisher",
    "RawMessage",
    "RawSubscription",
    "Subscription",
    "Unreachable",
    "open",
]
