"""Messages as they cross the bus, and the check of their type, version and content.

An invalid message is refused at a door ([shared/door.py](../door.py)).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import zenoh

from shared.door import Door
from shared.messages import validation
from shared.messages.checks.values import MAX_INTEGER
from shared.topics import Topic, find
from shared.version import MESSAGE_VERSION

MAX_PUBLISHERS = 4096
"""Most publishers whose numbers are remembered."""
PROTOBUF_ENCODING = "application/protobuf;"
"""Encoding of a message, before the full name of its type."""
MAX_PUBLISHER_LENGTH = 128
"""Number of characters after which the id of a publisher is cut."""


class RawMessage(NamedTuple):
    """Message as it crossed the bus, not decoded."""

    key: str
    """Concrete key of its topic."""
    type: str
    """Full name of its protobuf type, e.g. lariat.NodeChain."""
    payload: bytes
    """Serialised message."""
    publisher: str
    """Id of the process start that sent it."""
    sequence: int
    """Number among the publisher's messages on this topic, from 0."""
    received: int
    """Time of receipt on this process' clock [ns]."""
    version: int = 0
    """Version of the publisher's message set; 0 if not given."""
    published: int = 0
    """Time at which it was sent, by the publisher's clock [ns]; 0 if not given."""

    @property
    def topic(self) -> Topic:
        """Topic of the message.

        Raises:
            KeyError: This version of Lariat has no such topic.
        """
        return find(self.key)

    @property
    def source(self) -> str:
        """Topic and publisher, in words."""
        return f"{self.key} from {self.publisher or 'an unnamed publisher'}"


class MessageCheck:
    """Decoder of one subscription's messages."""

    def __init__(self) -> None:
        self.door = Door()
        """Refuses messages for their key, type, version or invalid content."""

    def decode(self, topic: Topic, raw: RawMessage) -> Any:
        """Return the decoded message of a topic, or None if it is refused."""
        with self.door.guard(raw.source):
            expected = topic.type.DESCRIPTOR.full_name
            if raw.type != expected:
                raise ValueError(f"its type is {raw.type or 'not given'}, not {expected}")
            if raw.version > MESSAGE_VERSION:
                raise ValueError(
                    f"it has message version {raw.version}, this process reads versions up to "
                    f"{MESSAGE_VERSION}; update this process"
                )
            return validation.decode(topic, raw.payload)
        return None


def raw_message(sample: zenoh.Sample, received: int) -> RawMessage:
    """Return a message as it came, with the time of its receipt [ns]."""
    attached = sample.attachment
    attachment = attached.to_bytes() if attached else b""
    words = attachment.decode(errors="replace").split(" ")
    sequence, publisher, version, published = (*words, "", "", "", "")[:4]
    return RawMessage(
        key=str(sample.key_expr),
        type=str(sample.encoding).removeprefix(PROTOBUF_ENCODING),
        payload=sample.payload.to_bytes(),
        publisher=publisher[:MAX_PUBLISHER_LENGTH],
        sequence=_integer(sequence),
        received=received,
        version=_integer(version),
        published=_integer(published),
    )


def _integer(text: str) -> int:
    """Integer of at most 19 digits that fits a message; 0 for any other text."""
    valid = text.isascii() and text.isdecimal() and len(text) <= 19
    return min(int(text), MAX_INTEGER) if valid else 0
