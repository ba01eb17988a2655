"""Check of messages as they crossed the bus: type, version and content.

An invalid message is refused at a door ([shared/door.py](../door.py)).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from shared.door import Door
from shared.messages import validation
from shared.topics import Topic
from shared.version import MESSAGE_VERSION

MAX_PUBLISHERS = 4096
"""Most publishers whose numbers are remembered."""


@dataclass(frozen=True)
class RawMessage:
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
