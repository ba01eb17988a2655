"""Node of ROS 2 with its publishers, subscriptions, services and clients.

Nothing is called back: what has arrived waits in bounded rings until it is taken.
"""

from __future__ import annotations

import itertools
import json
import time
from collections import deque
from collections.abc import Iterator
from typing import Any, TypeVar

import zenoh
import zenoh.ext
from zenoh.handlers import RingChannel

from shared.bus import BusError
from shared.bus.configuration import SEND_QUEUE_SIZE
from shared.bus.lingering import close_at_once
from shared.door import Door
from shared.ros2.router import DEFAULT_ROUTER
from shared.ros2.types import decoded, encoded
from shared.ros2.wire import SERVICE, Attachment, Entity, Kind, NodeEntity, Qos

ROUTER_TIMEOUT = 1.0
"""Longest wait for a router before one is served [s]."""
THIS_MACHINE = ("127.0.0.1", "localhost", "[::1]", "0.0.0.0", "[::]")
"""Hosts of routers that serve this machine."""
MAX_MESSAGE_SIZE = 2**25 + 2**16
"""Largest message that is taken [bytes]: a depth image of 4096 x 4096 pixels, with its header."""
MAX_STRUCTURED_SIZE = 2**18
"""Largest message but those of images that is decoded [bytes]: fields take time one by one."""
IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
"""Types whose content is bytes."""
REQUEST_CAPACITY = 32
"""Number of requests that wait unread for a service."""
HEARTBEAT = 0.5
"""Time after which a reliable latched publisher tells the number of a new sample [s]."""
_CDR = zenoh.Encoding.APPLICATION_CDR
E = TypeVar("E", "Publisher", "Subscription", "Service", "Client")


class Node:
    """Node in a Zenoh session of its own."""

    def __init__(
        self,
        name: str,
        namespace: str = "",
        domain: int = 0,
        router: str = DEFAULT_ROUTER,
        door: Door | None = None,
        serve: bool = True,
    ) -> None:
        """Join the graph, as the router where none answers and `serve` says so."""
        self.door = door or Door()
        self._session, self.serves_router = _joined(router, serve)
        close_at_once(self._session)
        self._numbers = itertools.count()
        zid = str(self._session.zid())
        self.entity = NodeEntity(domain, zid, next(self._numbers), namespace, name)
        self._kept: list[Any] = [self._session.liveliness().declare_token(self.entity.token)]
        """Tokens and endpoints, which end when nobody holds them."""

    def publisher(self, topic: str, kind: str, qos: Qos | None = None) -> Publisher:
        """Return a publisher; a name without leading slash lies in the node's namespace."""
        return self._shown(Publisher(self._session, self._entity("MP", topic, kind, qos or Qos())))

    def subscription(self, topic: str, kind: str, qos: Qos | None = None) -> Subscription:
        """Return a subscription to a topic; see `publisher`."""
        entity = self._entity("MS", topic, kind, qos or Qos())
        return self._shown(Subscription(self._session, entity, self.door))

    def service(self, name: str, kind: str) -> Service:
        """Return the server of a service; see `publisher`."""
        entity = self._entity("SS", name, kind, SERVICE)
        return self._shown(Service(self._session, entity, self.door))

    def client(self, name: str, kind: str) -> Client:
        """Return a client of a service; see `publisher`."""
        return self._shown(Client(self._session, self._entity("SC", name, kind, SERVICE)))

    def close(self) -> None:
        """Leave the graph."""
        self._session.close()

    def _entity(self, kind: Kind, topic: str, type: str, qos: Qos) -> Entity:
        name = self.entity.resolved(topic)
        return Entity(self.entity, next(self._numbers), kind, name, type, qos)

    def _shown(self, endpoint: E) -> E:
        """Endpoint that the graph knows from now on: who sees a service may call it at once."""
        token = self._session.liveliness().declare_token(endpoint.entity.token)
        self._kept += [endpoint, token]
        return endpoint


class Publisher:
    """Publisher of one topic."""

    def __init__(self, session: zenoh.Session, entity: Entity) -> None:
        self.entity = entity
        qos, reliability = entity.qos, zenoh.Reliability
        self._matched = qos.latched
        options: dict[str, Any] = {
            "encoding": _CDR,
            # Never wait for a reader.
            "congestion_control": zenoh.CongestionControl.DROP,
            "reliability": reliability.RELIABLE if qos.reliable else reliability.BEST_EFFORT,
        }
        if qos.latched:
            miss = zenoh.ext.MissDetectionConfig(sporadic_heartbeat=HEARTBEAT)
            self._publisher: Any = zenoh.ext.declare_advanced_publisher(
                session,
                entity.key,
                cache=zenoh.ext.CacheConfig(max_samples=qos.depth),
                publisher_detection=True,
                sample_miss_detection=miss if qos.reliable else None,
                **options,
            )
        else:
            self._publisher = session.declare_publisher(entity.key, **options)
            # For its status alone, Zenoh searches the graph.
            self._changes = self._publisher.declare_matching_listener(RingChannel(1))
        self._sequence = 0

    @property
    def matched(self) -> bool:
        """Whether anybody subscribes, or may come later for a latched topic's last message."""
        if not self.entity.qos.latched and (change := self._changes.try_recv()):
            self._matched = change.matching
        return self._matched

    def put(self, message: Any) -> None:
        """Publish a message of the topic's type."""
        self._sequence += 1
        attachment = Attachment(self._sequence, time.time_ns(), self.entity.gid)
        self._publisher.put(encoded(message), attachment=attachment.encoded())


class Subscription:
    """Subscription to one topic."""

    def __init__(self, session: zenoh.Session, entity: Entity, door: Door) -> None:
        self.entity = entity
        self._door = door
        qos = entity.qos
        ring = RingChannel(qos.depth)
        if qos.latched:
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=qos.depth)
            self._subscriber: Any = zenoh.ext.declare_advanced_subscriber(
                session,
                entity.key,
                ring,
                history=history,
                recovery=zenoh.ext.RecoveryConfig(heartbeat=True) if qos.reliable else None,
                subscriber_detection=True,
            )
        else:
            self._subscriber = session.declare_subscriber(entity.key, ring)

    def take(self) -> Iterator[Any]:
        """Yield the messages since the last call, those of its depth at most."""
        for _ in range(self.entity.qos.depth):
            sample = self._subscriber.try_recv()
            if sample is None:
                return
            with self._door.guard(f"ROS 2 {self.entity.topic}"):
                message = _content(sample.payload, sample.attachment, self.entity.type)[0]
                yield message


class Request:
    """Request of a client, which is answered now or later."""

    def __init__(self, query: zenoh.Query, entity: Entity, message: Any, asked: Attachment) -> None:
        self.message = message
        """Message of the request."""
        self._query = query
        self._entity = entity
        self._asked = asked

    def reply(self, response: Any) -> None:
        """Answer, once."""
        attachment = Attachment(self._asked.sequence, time.time_ns(), self._asked.gid)
        self._query.reply(
            self._entity.key, encoded(response), encoding=_CDR, attachment=attachment.encoded()
        )
        self._query.drop()


class Service:
    """Server of one service."""

    def __init__(self, session: zenoh.Session, entity: Entity, door: Door) -> None:
        self.entity = entity
        self._door = door
        self._queryable = session.declare_queryable(
            entity.key, RingChannel(REQUEST_CAPACITY), complete=True
        )

    def take(self) -> Iterator[Request]:
        """Yield the requests since the last call; of a flood, the newest."""
        for _ in range(REQUEST_CAPACITY):
            query = self._queryable.try_recv()
            if query is None:
                return
            with self._door.guard(f"ROS 2 {self.entity.topic}") as outcome:
                content = _content(query.payload, query.attachment, f"{self.entity.type}_Request")
            if outcome.refusal:
                query.reply_err(outcome.refusal.encode())
                query.drop()
            else:
                yield Request(query, self.entity, *content)


class Call:
    """Call of a service that has been sent."""

    def __init__(self, kind: str, timeout: float) -> None:
        self.replies: deque[zenoh.Reply] = deque(maxlen=1)
        self._kind = kind
        self._deadline = time.monotonic() + timeout

    def take(self) -> Any | None:
        """Return the response; None before it has come.

        ValueError: refused, or nonsense. TimeoutError: no answer in time, or no such service.
        """
        if not self.replies:
            if time.monotonic() > self._deadline:
                raise TimeoutError("the service has not answered in time")
            return None
        reply = self.replies[0]
        if reply.ok is None:
            reason = reply.err.payload.to_bytes().decode(errors="replace")
            raise TimeoutError(reason) if reason == "Timeout" else ValueError(reason)
        return _content(reply.ok.payload, reply.ok.attachment, self._kind)[0]


class Client:
    """Client of one service."""

    def __init__(self, session: zenoh.Session, entity: Entity) -> None:
        self.entity = entity
        self._session = session
        self._querier = session.declare_querier(entity.key, target=zenoh.QueryTarget.ALL_COMPLETE)
        self._sequence = 0

    @property
    def matched(self) -> bool:
        """Whether a server is there."""
        return self._querier.matching_status.matching  # pyright: ignore[reportAttributeAccessIssue]

    def call(self, request: Any, timeout: float) -> Call:
        """Send a request; its response is waited for until `timeout` [s]."""
        self._sequence += 1
        attachment = Attachment(self._sequence, time.time_ns(), self.entity.gid)
        call = Call(f"{self.entity.type}_Response", timeout)
        self._session.get(
            self.entity.key,
            call.replies.append,
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout,
            payload=encoded(request),
            encoding=_CDR,
            attachment=attachment.encoded(),
        )
        return call


def _content(payload: Any, attachment: Any, kind: str) -> tuple[Any, Attachment]:
    """Message and attachment of a sample, request or reply."""
    if payload is None or attachment is None:
        raise ValueError("it has no payload or attachment, as those of rmw_zenoh have")
    sender = Attachment.decoded(attachment.to_bytes())
    if len(payload) > MAX_STRUCTURED_SIZE and kind not in IMAGES:
        raise ValueError(
            f"{len(payload)} bytes are more than the {MAX_STRUCTURED_SIZE} of a message"
        )
    return decoded(payload.to_bytes(), kind), sender


def _joined(router: str, serve: bool) -> tuple[zenoh.Session, bool]:
    """Session of a router, and whether it is the router itself."""
    host = router.partition("/")[2].rpartition(":")[0]
    # Peers accept those of their machine alone; to others their router speaks, if they are clients.
    join = "peer" if host in THIS_MACHINE else "client"
    reason = ""
    # Another node may begin to serve the router meanwhile.
    for mode in (join, "router", join) if serve else (join,):
        try:
            return zenoh.open(_configuration(mode, router)), mode == "router"
        except zenoh.ZError as error:
            reason = str(error).partition(" at /")[0]
    raise BusError(f"no ROS 2 router answers at {router}: {reason}")


def _configuration(mode: str, router: str) -> zenoh.Config:
    settings: dict[str, Any] = {
        "mode": mode,
        "connect/endpoints": [] if mode == "router" else [router],
        # One attempt.
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": True,
        "transport/unicast/open_timeout": int(1e3 * ROUTER_TIMEOUT),
        "listen/endpoints": {"router": [router], "peer": ["tcp/127.0.0.1:0"]}.get(mode, []),
        # A router waits for no other node [ms].
        "scouting/delay": 0 if mode == "router" else 500,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        # Latched publishers answer with stamped samples.
        "timestamping/enabled": True,
        "transport/shared_memory/enabled": False,
        "transport/link/rx/max_message_size": MAX_MESSAGE_SIZE,
        # An image does not wait for the network's thread, batch by batch.
        "transport/link/tx/queue/size/data": SEND_QUEUE_SIZE,
    }
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config
