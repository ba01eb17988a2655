"""Check of messages as they crossed the bus: type, version and content.

An invalid message is dropped and counted, and the log says so at counts of 1, 10, 100, …
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

from shared.messages import validation
from shared.topics import Topic
from shared.version import MESSAGE_VERSION

log = logging.getLogger(__name__)

MAX_REASON_LENGTH = 200
"""Number of characters after which the reason of a refusal is cut: it may quote the message."""
MAX_PUBLISHERS = 4096
"""Most publishers whose numbers and refused messages are remembered."""


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


class MessageCheck:
    """Decoder of one subscription's messages, with the count of those that it refused."""

    def __init__(self) -> None:
        self.refused = 0
        """Number of messages dropped for their key, type, version or invalid content."""
        self._refused: dict[tuple[str, str], int] = {}

    def decode(self, topic: Topic, raw: RawMessage) -> Any:
        """Return the decoded message of a topic, or None if it is refused."""
        expected = topic.type.DESCRIPTOR.full_name
        if raw.type != expected:
            return self.refuse(raw, f"its type is {raw.type or 'not given'}, not {expected}")
        if raw.version > MESSAGE_VERSION:
            return self.refuse(
                raw,
                f"it has message version {raw.version}, this process reads versions up to "
                f"{MESSAGE_VERSION}; update this process",
            )
        try:
            return validation.decode(topic, raw.payload)
        except ValueError as error:
            return self.refuse(raw, str(error))

    def refuse(self, raw: RawMessage, reason: str) -> None:
        """Count a message that is dropped, and log the reason."""
        count = self._refused.pop((raw.key, raw.publisher), 0) + 1
        self._refused[raw.key, raw.publisher] = count
        self.refused += 1
        if len(self._refused) > MAX_PUBLISHERS:
            del self._refused[next(iter(self._refused))]
        # The log must stay readable.
        if count == 10 ** (len(str(count)) - 1):
            log.warning(
                "dropped %s from %s: %s (%d so far)",
                raw.key,
                raw.publisher or "an unnamed publisher",
                reason[:MAX_REASON_LENGTH],
                count,
            )
