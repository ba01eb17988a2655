"""Encoding and attachment of a message on the bus."""

from __future__ import annotations

import zenoh

from shared.bus.message_check import RawMessage
from shared.messages.checks.values import MAX_INTEGER

PROTOBUF_ENCODING = "application/protobuf;"
"""Encoding of a message, before the full name of its type."""
MAX_PUBLISHER_LENGTH = 128
"""Number of characters after which the id of a publisher is cut."""


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
