"""Foxglove's WebSocket protocol, as far as a server needs it whose clients only read.

The server announces itself and its channels in JSON, a client subscribes to channels in JSON, and
messages follow in binary. No socket is opened here.
"""

from __future__ import annotations

import base64
import json
import struct
from collections import defaultdict
from dataclasses import dataclass, field

from shared.recording.writer import descriptor_set
from shared.topics import Topic

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names of the protocol, the newest first; for a reading client they are the same."""
MESSAGE_DATA = 1
"""Kind of a binary frame that holds a message."""
WARNING = 1
"""Level of a status for the person at the client."""
MAX_SUBSCRIPTIONS = 4096
"""Most subscriptions of a client."""


def server_info(name: str, session: str) -> str:
    """Return the first frame of a connection."""
    return json.dumps(
        {
            "op": "serverInfo",
            "name": name,
            # No capability: no publishing, no parameters, no services.
            "capabilities": [],
            "supportedEncodings": [],
            "metadata": {},
            "sessionId": session,
        }
    )


def advertisement(channels: dict[int, Topic]) -> str:
    """Return the frame that announces channels by their ids."""
    return json.dumps(
        {"op": "advertise", "channels": [_channel(number, t) for number, t in channels.items()]}
    )


def message_data(subscription: int, time: int, payload: bytes) -> bytes:
    """Return the frame of a message for a subscription, received at a time [ns]."""
    return struct.pack("<BIQ", MESSAGE_DATA, subscription, time) + payload


def _channel(number: int, topic: Topic) -> dict[str, object]:
    descriptor = topic.type.DESCRIPTOR
    schema = descriptor_set(descriptor).SerializeToString(deterministic=True)
    return {
        "id": number,
        "topic": topic.key,
        "encoding": "protobuf",
        "schemaName": descriptor.full_name,
        "schema": base64.b64encode(schema).decode(),
        "schemaEncoding": "protobuf",
    }


@dataclass
class Subscriptions:
    """Subscriptions of one client."""

    _channels: dict[int, int] = field(default_factory=dict)
    _by_channel: dict[int, set[int]] = field(default_factory=lambda: defaultdict(set))

    def of_channel(self, channel: int) -> frozenset[int]:
        """Return the ids of the subscriptions to a channel."""
        return frozenset(self._by_channel.get(channel, ()))

    def take(self, frame: str | bytes) -> str | None:
        """Take a frame of the client; return a frame that answers it, if any.

        What a reading client does not send is answered with a warning and has no other effect.
        """
        try:
            request = json.loads(frame) if isinstance(frame, str) else {"op": "binary data"}
            operation = request["op"]
            if operation == "subscribe":
                for each in request["subscriptions"]:
                    self._add(int(each["id"]), int(each["channelId"]))
            elif operation == "unsubscribe":
                for number in request["subscriptionIds"]:
                    self._remove(int(number))
            else:
                return _warning(f"this server is read-only; {operation!r} has no effect")
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            return _warning("a frame is not of Foxglove's WebSocket protocol")
        return None

    def _add(self, number: int, channel: int) -> None:
        if not 0 <= number < 2**32 or len(self._channels) >= MAX_SUBSCRIPTIONS:
            raise ValueError(number)
        self._remove(number)
        self._channels[number] = channel
        self._by_channel[channel].add(number)

    def _remove(self, number: int) -> None:
        channel = self._channels.pop(number, None)
        if channel is not None:
            self._by_channel[channel].discard(number)


def _warning(text: str) -> str:
    return json.dumps({"op": "status", "level": WARNING, "message": text})
