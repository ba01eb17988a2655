"""The bus: topics over Zenoh. The only file that imports zenoh.

Peers on loopback find each other by gossip through the hub that the launcher holds; nothing is
multicast. Every message carries its protobuf type in the encoding, its publisher and its number in
the attachment, with the version of the message set: a message of a newer version is refused.
Channels are bounded rings that never make a publisher wait: what a reader was too
slow for is missing from the numbers, and counted.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import zenoh
from google.protobuf.message import DecodeError
from zenoh.handlers import RingChannel

from shared.clock import Clock, SystemClock
from shared.messages import Message
from shared.service import Received
from shared.topics import Topic
from shared.version import MESSAGE_VERSION

log = logging.getLogger(__name__)

HUB = "tcp/127.0.0.1:7447"
"""Where the launcher holds the hub unless told otherwise."""
_CAPACITY = {"latest": 1, "joined": 4, "every": 512}
_WILDCARD_CAPACITY = 128
_PROTOBUF = "application/protobuf;"


@dataclass(frozen=True)
class BusOptions:
    """How a process joins the bus."""

    namespace: str = "cell"
    """Name of the cell; several cells share one network without hearing each other."""
    connect: tuple[str, ...] = (HUB,)
    """Endpoints to connect to, now or as soon as they exist."""
    listen: tuple[str, ...] = ("tcp/127.0.0.1:0",)
    """Endpoints to listen on; port 0 is any free one."""
    mode: Literal["peer", "client", "router"] = "peer"
    settings: Path | None = None
    """A JSON object of further Zenoh settings by their path, e.g. for TLS, users and access
    control: {"transport/auth/usrpwd/user": "controller"}."""


class BusError(ValueError):
    """The bus cannot be joined; one line that says why, and the way out."""


class Unreachable(BusError):
    """Nobody answers where the bus should be."""


@dataclass(frozen=True)
class Raw:
    """A message as it crossed the bus, not yet decoded."""

    key: str
    type: str
    """Full name of its protobuf type, e.g. lariat.NodeChain."""
    payload: bytes
    publisher: str
    sequence: int
    received: int
    """Local receipt time [ns]."""
    version: int = 0
    """Version of the publisher's message set; 0 where it names none."""


@contextmanager
def open(
    options: BusOptions, publisher: str, clock: Clock | None = None, timeout: float | None = None
) -> Iterator[Bus]:
    """The bus, left when the block ends.

    Args:
        publisher: Id of this start of the process, which every message carries.
        timeout: Give up when nobody answers at `connect` for so long [s]; None joins whoever
            comes, whenever they come.

    Raises:
        Unreachable: Nobody answered in time.
        BusError: An endpoint is taken or a setting is wrong.
    """
    try:
        session = zenoh.open(_config(options, timeout))
    except zenoh.ZError as error:
        raise _reason(options, str(error)) from None
    # An open session with subscribers keeps the interpreter from exiting.
    try:
        yield Bus(session, publisher, clock or SystemClock())
    finally:
        session.close()


class Publisher:
    """Sends the messages of one topic."""

    def __init__(self, session: zenoh.Session, topic: Topic, publisher: str) -> None:
        if topic.urgent:
            priority = zenoh.Priority.REAL_TIME
        else:
            priority = zenoh.Priority.DATA_LOW if topic.large else zenoh.Priority.DATA
        # Never wait for a reader: one frozen dashboard would stop the arm's heartbeat for as long
        # as its connection is believed alive.
        self._publisher = session.declare_publisher(
            topic.key,
            encoding=zenoh.Encoding(_PROTOBUF + topic.type.DESCRIPTOR.full_name),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=priority,
            express=topic.urgent,
        )
        self._topic = topic
        self._name = publisher
        self.sequence = 0
        """Number of the next message."""

    @property
    def heard(self) -> bool:
        """Whether anybody subscribes."""
        return self._publisher.matching_status.matching

    def put(self, message: Message) -> None:
        """Sends one message.

        Raises:
            TypeError: The message is not of the topic's type.
        """
        if not isinstance(message, self._topic.type):
            raise TypeError(
                f"{self._topic.key} takes {self._topic.type.DESCRIPTOR.full_name}, "
                f"not {type(message).__name__}"
            )
        payload = message.SerializeToString(deterministic=True)
        self._publisher.put(payload, attachment=f"{self.sequence} {self._name} {MESSAGE_VERSION}")
        self.sequence += 1


@dataclass
class _Gaps:
    """Counts what is missing from publishers' numbers."""

    lost: int = 0
    _next: dict[tuple[str, str], int] = field(default_factory=dict)

    def see(self, key: str, publisher: str, sequence: int) -> None:
        expected = self._next.get((key, publisher), sequence)
        self.lost += max(0, sequence - expected)
        self._next[key, publisher] = sequence + 1


class Everything:
    """All messages of the cell, undecoded."""

    def __init__(self, session: zenoh.Session, clock: Clock, capacity: int) -> None:
        self._subscriber = session.declare_subscriber("**", RingChannel(capacity))
        self._clock = clock
        self._gaps = _Gaps()

    @property
    def lost(self) -> int:
        """Messages that never came or that this reader was too slow for."""
        return self._gaps.lost

    def take(self) -> list[Raw]:
        """What arrived since the last call, in order of arrival."""
        items = []
        while (sample := self._subscriber.try_recv()) is not None:
            raw = _raw(sample, self._clock.now())
            self._gaps.see(raw.key, raw.publisher, raw.sequence)
            items.append(raw)
        return items


class Subscription:
    """The messages of one topic, decoded; of all its keys where it holds a placeholder."""

    def __init__(self, session: zenoh.Session, topic: Topic, clock: Clock) -> None:
        key = _expression(topic.key)
        capacity = _WILDCARD_CAPACITY if "*" in key else _CAPACITY[topic.hold]
        self._subscriber = session.declare_subscriber(key, RingChannel(capacity))
        self._topic = topic
        self._clock = clock
        self._gaps = _Gaps()
        self._refused: dict[tuple[str, str], int] = {}

    @property
    def lost(self) -> int:
        """Messages that never came or that a newer one replaced unread."""
        return self._gaps.lost

    @property
    def refused(self) -> int:
        """Messages dropped because they are not what the topic carries."""
        return sum(self._refused.values())

    def take(self) -> list[tuple[str, Received]]:
        """What arrived since the last call, with its key, in order of arrival."""
        items = []
        while (sample := self._subscriber.try_recv()) is not None:
            raw = _raw(sample, self._clock.now())
            self._gaps.see(raw.key, raw.publisher, raw.sequence)
            message = self._decoded(raw)
            if message is not None:
                received = Received(message, raw.publisher, raw.sequence, raw.received)
                items.append((raw.key, received))
        return items

    def _decoded(self, raw: Raw) -> Any:
        expected = self._topic.type.DESCRIPTOR.full_name
        if raw.type != expected:
            return self._refuse(raw, f"it is {raw.type or 'of no type'}, not {expected}")
        if raw.version > MESSAGE_VERSION:
            return self._refuse(
                raw,
                f"it has message version {raw.version}, this process knows up to "
                f"{MESSAGE_VERSION}; update it",
            )
        try:
            return self._topic.type.FromString(raw.payload)
        except DecodeError as error:
            return self._refuse(raw, f"{len(raw.payload)} bytes do not decode: {error}")

    def _refuse(self, raw: Raw, reason: str) -> None:
        count = self._refused.get((raw.key, raw.publisher), 0) + 1
        self._refused[raw.key, raw.publisher] = count
        # A stream of them is said at 1, 10, 100, …: the log must stay readable.
        if count == 10 ** (len(str(count)) - 1):
            log.warning(
                "dropped %s from %s: %s (%d so far)",
                raw.key,
                raw.publisher or "an unnamed publisher",
                reason,
                count,
            )


class Bus:
    """One process on the bus; made by `open`."""

    def __init__(self, session: zenoh.Session, publisher: str, clock: Clock) -> None:
        self._session = session
        self._publisher = publisher
        self._clock = clock

    def publisher(self, topic: Topic) -> Publisher:
        """What sends the messages of one topic; its placeholder must be filled."""
        if "{" in topic.key:
            raise ValueError(f"topic {topic.key!r} has no name yet; fill it with topic.at(name)")
        return Publisher(self._session, topic, self._publisher)

    def subscribe(self, topic: Topic) -> Subscription:
        """The messages of one topic from now on."""
        return Subscription(self._session, topic, self._clock)

    def subscribe_all(self, capacity: int = 8192) -> Everything:
        """All messages of the cell from now on, at most `capacity` unread ones."""
        return Everything(self._session, self._clock, capacity)

    def declare_alive(self, service: str) -> None:
        """Shows this process to `alive` for as long as it lives."""
        # The token dies with its last reference.
        self._token = self._session.liveliness().declare_token(f"alive/{service}")

    def alive(self, timeout: float = 0.5) -> set[str]:
        """The services of the cell that are connected; a frozen one goes after 2 s."""
        replies = self._session.liveliness().get("alive/*", timeout=timeout)
        return {str(r.ok.key_expr).removeprefix("alive/") for r in replies if r.ok is not None}


def _raw(sample: zenoh.Sample, received: int) -> Raw:
    attachment = sample.attachment.to_bytes() if sample.attachment else b""
    words = attachment.decode(errors="replace").split(" ")
    sequence, publisher, version = (*words, "", "", "")[:3]
    return Raw(
        key=str(sample.key_expr),
        type=str(sample.encoding).removeprefix(_PROTOBUF),
        payload=sample.payload.to_bytes(),
        publisher=publisher,
        sequence=int(sequence) if sequence.isdecimal() else 0,
        received=received,
        version=int(version) if version.isdecimal() else 0,
    )


def _expression(key: str) -> str:
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
        # ms until a frozen process counts as gone
        "transport/link/tx/lease": 2000,
    }
    if timeout is not None:
        settings["connect/timeout_ms"] = int(1e3 * timeout)
        settings["connect/exit_on_failure"] = True
    # Deep enough for a sender whose network thread waits for a core: 16 is the most it takes.
    for priority in ("real_time", "data", "data_low"):
        settings[f"transport/link/tx/queue/size/{priority}"] = 16
    if options.settings:
        settings.update(_further(options.settings))
    config = zenoh.Config()
    for key, value in settings.items():
        try:
            config.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise BusError(f"Zenoh refuses {key} = {json.dumps(value)}: {error}") from None
    return config


def _further(path: Path) -> dict[str, Any]:
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BusError(f"cannot read bus settings {path}: {error}") from None
    if not isinstance(table, dict):
        raise BusError(f"bus settings {path} must be one JSON object of settings by their path")
    return table


def _reason(options: BusOptions, error: str) -> BusError:
    connect = ", ".join(options.connect)
    if "already in use" in error:
        return BusError(f"{', '.join(options.listen)} is taken; is another stack running there?")
    if "nable to connect" in error:
        hint = " (a wrong password looks the same)" if options.settings else ""
        return Unreachable(f"no stack answers at {connect}{hint}; is `lariat up` running?")
    return BusError(f"cannot join the bus at {connect}: {error.splitlines()[0]}")


__all__ = [
    "HUB",
    "Bus",
    "BusError",
    "BusOptions",
    "Everything",
    "Publisher",
    "Raw",
    "Subscription",
    "Unreachable",
    "open",
]
