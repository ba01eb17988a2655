"""Validity of messages from the bus: whoever may publish, nobody may end a process with a message.

Checks that hold for every message (payload size, known enum values, finite vectors, bounded
integers, texts and counts) follow from the descriptors; lengths that must fit each other have a
check for each message type. Numbers of setpoints are left to the gateway, which refuses them by the
name of a rule.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.message import DecodeError, Message

from lariat.plain_text import is_plain, plain_text
from shared import messages
from shared.messages.checks import arms, rope, runs, scene, task
from shared.messages.checks.values import MAX_INTEGER, MAX_MAGNITUDE, all_within, check_integer
from shared.topics import Topic

MAX_STREAMED_SIZE = 256 * 1024
"""Largest payload of the messages that are published at every step [bytes]."""
MAX_COUNT = 200_000
"""Largest number of values of a field; a path of 2 m of rope has 54 000."""
MAX_TEXT_LENGTH = 4096
"""Largest number of characters of a text."""


def decode(topic: Topic, payload: bytes) -> Any:
    """Decode a message of a topic and check it; its texts get escapes for control characters."""
    if len(payload) > topic.max_size:
        raise ValueError(f"{len(payload)} bytes, more than {topic.max_size}")
    try:
        message = topic.type.FromString(payload)
    except DecodeError as error:
        raise ValueError(f"its {len(payload)} bytes do not decode: {error}") from error
    if topic.type not in _COMPLETE_CHECKS:
        _check_fields(message)
    elif len(payload) > MAX_STREAMED_SIZE:
        raise ValueError(f"{len(payload)} bytes, more than {MAX_STREAMED_SIZE}")
    if check := _CHECKS.get(topic.type):
        check(message)
    return message


def _check_fields(message: Message) -> None:
    beside_bytes = _beside_bytes(message.DESCRIPTOR)
    pairs = ((field, getattr(message, field.name)) for field in beside_bytes)
    for field, value in pairs if beside_bytes else message.ListFields():
        values = value if field.is_repeated else (value,)
        if len(values) > MAX_COUNT:
            raise ValueError(f"{field.name} has {len(values)} values, more than {MAX_COUNT}")
        if (kind := field.message_type) is not None:
            if kind.full_name == "google.protobuf.Timestamp":
                check_integer(field.name, value.seconds * 10**9 + value.nanos)
            if not _takes_any_value(kind):
                for item in values:
                    _check_fields(item)
        elif field.enum_type is not None:
            for item in values:
                if item not in field.enum_type.values_by_number:
                    raise ValueError(f"{field.name} = {item} is not a value of the enum")
        else:
            _check_scalars(field, values)
            if field.type == FieldDescriptor.TYPE_STRING and not all(map(is_plain, values)):
                _make_plain(message, field)


@cache
def _beside_bytes(kind: Descriptor) -> tuple[FieldDescriptor, ...]:
    """Other fields of a type that has bytes, which take any value and are copied when read: those
    of an image."""
    others = tuple(field for field in kind.fields if field.type != FieldDescriptor.TYPE_BYTES)
    return others if len(others) < len(kind.fields) else ()


@cache
def _takes_any_value(kind: Descriptor) -> bool:
    """Whether the general check leaves a type out: entries of maps, and what holds single floats
    alone, as points and colors, of which a drawing has thousands."""
    floats = FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT
    return kind.GetOptions().map_entry or all(
        not field.is_repeated
        and (
            _takes_any_value(field.message_type) if field.message_type else field.cpp_type in floats
        )
        for field in kind.fields
    )


def _make_plain(message: Message, field: FieldDescriptor) -> None:
    """Replace control characters in a text, or in several."""
    value = getattr(message, field.name)
    if field.is_repeated:
        texts = [plain_text(text) for text in value]
        del value[:]
        value.extend(texts)
    else:
        setattr(message, field.name, plain_text(value))


def _check_scalars(field: FieldDescriptor, values: Sequence[Any]) -> None:
    match field.cpp_type:
        case FieldDescriptor.CPPTYPE_DOUBLE | FieldDescriptor.CPPTYPE_FLOAT:
            # Scalars may be infinite, such as the clearance in an empty scene.
            if field.is_repeated and not all_within(values, MAX_MAGNITUDE):
                raise ValueError(f"{field.name} holds a number beyond ±{MAX_MAGNITUDE:g}, or none")
        case FieldDescriptor.CPPTYPE_INT64 | FieldDescriptor.CPPTYPE_UINT64:
            if any(abs(value) > MAX_INTEGER for value in values):
                raise ValueError(f"{field.name} holds an integer beyond ±2^62")
        case FieldDescriptor.CPPTYPE_STRING if field.type == FieldDescriptor.TYPE_STRING:
            if any(len(value) > MAX_TEXT_LENGTH for value in values):
                raise ValueError(f"{field.name} is longer than {MAX_TEXT_LENGTH} characters")


_CHECKS = {**rope.CHECKS, **arms.CHECKS, **task.CHECKS, **scene.CHECKS, **runs.CHECKS}
_COMPLETE_CHECKS = {messages.ArmStates, messages.NodeChain, messages.Plan, messages.Setpoints}
"""Types whose own check leaves nothing to the general one: those of every step."""
