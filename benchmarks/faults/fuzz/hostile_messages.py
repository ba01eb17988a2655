"""Generator of hostile messages of a topic: random bytes, mutated messages, extreme values."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping, Sequence

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from shared.bus.message_check import RawMessage
from shared.topics import TOPICS, Topic
from shared.version import MESSAGE_VERSION

NUMBERS = (0.0, -0.0, 1.0, -1.0, 1e-300, 1e6, -1e6, 1e30, 1e308, math.inf, -math.inf, math.nan)
"""Hostile values of floating-point fields."""
INTEGERS = (0, 1, -1, 2, 77, 2**31 - 1, -(2**31), 2**32 - 1, 2**62, 2**63 - 1, -(2**63), 2**64 - 1)
"""Hostile values of integer fields, as far as they fit."""
TEXTS = ("", "left", "right", "table", "x" * 5000, "\x00", "../../etc/passwd", "ß\u202e😀", "NaN")
"""Hostile values of text fields."""
LENGTHS = (0, 1, 2, 3, 4, 6, 7, 9, 12, 30, 90, 120, 300, 6003)
"""Lengths of repeated fields."""
MAX_DEPTH = 3
"""Depth of nested messages that are filled."""

Kind = str
"""Name of a way to make a message."""


class HostileMessages:
    """Source of the hostile messages of all topics, reproducible by its seed."""

    def __init__(self, seed: str, corpus: Mapping[str, Sequence[bytes]]) -> None:
        """Create a source."""
        self._random = random.Random(seed)
        self._corpus = corpus
        self.kinds: dict[Kind, Callable[[Topic], bytes]] = {
            "random bytes": self._random_bytes,
            "mutated bytes": self._mutated_bytes,
            "mutated fields": self._mutated_fields,
            "random fields": self._random_fields,
            "another type": self._another_type,
            "valid": self._valid,
        }
        """Ways to make a message by name."""

    def draw(self, topic: Topic, received: int) -> RawMessage:
        """Return a message as it crosses the bus.

        Args:
            topic: Topic with a concrete key.
            received: Time of receipt [ns].
        """
        rng = self._random
        payload = self.kinds[rng.choice(list(self.kinds))](topic)
        kind = topic.type.DESCRIPTOR.full_name
        return RawMessage(
            key=topic.key,
            type=kind if rng.random() < 0.98 else rng.choice(("", "lariat.Nothing", "text/plain")),
            payload=payload,
            publisher=rng.choice(("stranger", "controller-0", "sim-0", f"p-{rng.random()}", "")),
            sequence=rng.choice((0, 1, rng.randrange(1000), 10**17, 10**18 - 1)),
            received=received,
            version=MESSAGE_VERSION if rng.random() < 0.98 else rng.choice((0, 99, 10**17)),
        )

    def _random_bytes(self, topic: Topic) -> bytes:
        del topic
        return self._random.randbytes(self._random.choice((0, 1, 2, 8, 64, 1000)))

    def _valid(self, topic: Topic) -> bytes:
        samples = self._corpus.get(topic.key)
        return self._random.choice(samples) if samples else self._random_fields(topic)

    def _mutated_bytes(self, topic: Topic) -> bytes:
        payload = bytearray(self._valid(topic))
        rng = self._random
        for _ in range(rng.randrange(1, 6)):
            if payload:
                payload[rng.randrange(len(payload))] = rng.randrange(256)
        if rng.random() < 0.3:
            return bytes(payload[: rng.randrange(len(payload) + 1)])
        return bytes(payload)

    def _mutated_fields(self, topic: Topic) -> bytes:
        message = topic.type.FromString(self._valid(topic))
        for _ in range(self._random.randrange(1, 4)):
            self._mutate(message)
        return message.SerializeToString()

    def _random_fields(self, topic: Topic) -> bytes:
        message = topic.type()
        self._fill(message, 0)
        return message.SerializeToString()

    def _another_type(self, topic: Topic) -> bytes:
        del topic
        return self._random_fields(self._random.choice(TOPICS))

    def _mutate(self, message: Message) -> None:
        """Change one field of a message or of one inside of it."""
        field = self._random.choice(message.DESCRIPTOR.fields)
        nested = _nested(message, field)
        if nested and self._random.random() < 0.7:
            self._mutate(self._random.choice(nested))
        elif field.is_repeated and field.message_type is None and self._random.random() < 0.5:
            values = list(getattr(message, field.name))
            if values and self._random.random() < 0.7:
                values[self._random.randrange(len(values))] = self._value(field)
            else:
                values = values[: self._random.randrange(len(values) + 1)]
            self._assign(message, field, values)
        else:
            message.ClearField(field.name)
            if self._random.random() < 0.8:
                self._set(message, field, MAX_DEPTH - 1)

    def _fill(self, message: Message, depth: int) -> None:
        for field in message.DESCRIPTOR.fields:
            if self._random.random() < 0.6:
                self._set(message, field, depth)

    def _set(self, message: Message, field: FieldDescriptor, depth: int) -> None:
        rng = self._random
        count = rng.choice(LENGTHS)
        if field.message_type is not None:
            if depth >= MAX_DEPTH or field.message_type.GetOptions().map_entry:
                return
            if not field.is_repeated:
                self._fill(getattr(message, field.name), depth + 1)
                return
            for _ in range(min(count, 4)):
                self._fill(getattr(message, field.name).add(), depth + 1)
        elif field.is_repeated:
            ordinary = rng.random() < 0.5
            value = [rng.uniform(-1.0, 1.0)] if ordinary and _is_real(field) else None
            self._assign(message, field, (value or [self._value(field)]) * count)
        else:
            self._assign(message, field, self._value(field))

    def _assign(self, message: Message, field: FieldDescriptor, value: object) -> None:
        try:
            if field.is_repeated:
                message.ClearField(field.name)
                getattr(message, field.name).extend(value)
            else:
                setattr(message, field.name, value)
        except (ValueError, TypeError, OverflowError):
            pass  # The value does not fit the field's type.

    def _value(self, field: FieldDescriptor) -> object:
        rng = self._random
        match field.cpp_type:
            case FieldDescriptor.CPPTYPE_DOUBLE | FieldDescriptor.CPPTYPE_FLOAT:
                return rng.choice((*NUMBERS, rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)))
            case FieldDescriptor.CPPTYPE_BOOL:
                return rng.random() < 0.5
            case FieldDescriptor.CPPTYPE_STRING:
                text = rng.choice(TEXTS)
                return text.encode() if field.type == FieldDescriptor.TYPE_BYTES else text
            case _:
                return rng.choice((*INTEGERS, rng.randrange(8), rng.randrange(8)))


def _is_real(field: FieldDescriptor) -> bool:
    return field.cpp_type in (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT)


def _nested(message: Message, field: FieldDescriptor) -> list[Message]:
    """Messages in a field."""
    if field.message_type is None or field.message_type.GetOptions().map_entry:
        return []
    value = getattr(message, field.name)
    return list(value) if field.is_repeated else [value]
