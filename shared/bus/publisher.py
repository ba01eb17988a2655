"""Publisher of one topic."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence

import zenoh

from shared.bus.message_check import PROTOBUF_ENCODING, RawMessage
from shared.messages import Message
from shared.runtime.clock import Clock
from shared.topics import Topic
from shared.version import MESSAGE_VERSION


class Publisher:
    """Publisher of one topic, in any thread."""

    def __init__(
        self,
        session: zenoh.Session,
        topic: Topic,
        publisher: str,
        clock: Clock,
        taps: Sequence[deque[RawMessage]],
    ) -> None:
        if topic.urgent:
            priority = zenoh.Priority.REAL_TIME
        else:
            priority = zenoh.Priority.DATA_LOW if topic.large else zenoh.Priority.DATA
        # Never wait for a reader: a frozen dashboard would stop the arm's heartbeat until its
        # connection times out.
        self._publisher = session.declare_publisher(
            topic.key,
            encoding=zenoh.Encoding(PROTOBUF_ENCODING + topic.type.DESCRIPTOR.full_name),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=priority,
            express=topic.urgent,
        )
        self._topic = topic
        self._name = publisher
        self._clock = clock
        self._taps = taps
        self._lock = threading.Lock()
        self.sequence = 0
        """Number of the next message."""

    @property
    def has_subscribers(self) -> bool:
        """Whether any process subscribes to the topic."""
        return self._publisher.matching_status.matching  # pyright: ignore[reportAttributeAccessIssue]

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
        with self._lock:
            self._put(payload)

    def _put(self, payload: bytes) -> None:
        now = self._clock.now()
        words = self.sequence, self._name, MESSAGE_VERSION, now
        self._publisher.put(payload, attachment=" ".join(map(str, words)))
        for tap in self._taps:
            tap.append(
                RawMessage(
                    key=self._topic.key,
                    type=self._topic.type.DESCRIPTOR.full_name,
                    payload=payload,
                    publisher=self._name,
                    sequence=self.sequence,
                    received=now,
                    version=MESSAGE_VERSION,
                    published=now,
                )
            )
        self.sequence += 1
