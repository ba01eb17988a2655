"""Recordings are read by the libraries of JavaScript as by those of Python, message by message."""

from __future__ import annotations

import base64
import math
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message
from mcap.reader import make_reader

from shared.recording import Writer
from shared.topics import TOPICS
from tests.javascript import needs_libraries, run
from tests.services.recorder.view import cell

pytestmark = needs_libraries
MAX_DEPTH = 4
"""Depth of nested messages that are filled."""
F = FieldDescriptor


def filled(message: Message, rng: random.Random, depth: int = 0) -> Message:
    """Fill every field with a random value of its type."""
    for field in message.DESCRIPTOR.fields:
        if _is_map(field):
            getattr(message, field.name)["one key"] = _value(_value_field(field), rng)
            continue
        count = 2 if field.is_repeated else 1
        for _ in range(count):
            if field.cpp_type == F.CPPTYPE_MESSAGE:
                if depth < MAX_DEPTH:
                    part = getattr(message, field.name)
                    filled(part.add() if field.is_repeated else part, rng, depth + 1)
                continue
            value = _value(field, rng)
            if field.is_repeated:
                getattr(message, field.name).append(value)
            else:
                setattr(message, field.name, value)
    return message


def _value_field(field: FieldDescriptor) -> FieldDescriptor:
    """Field of the values of a map."""
    assert field.message_type is not None
    return field.message_type.fields_by_name["value"]


def _is_map(field: FieldDescriptor) -> bool:
    return field.message_type is not None and field.message_type.GetOptions().map_entry


def _value(field: FieldDescriptor, rng: random.Random) -> Any:
    match field.cpp_type:
        case F.CPPTYPE_DOUBLE:
            return rng.choice([rng.gauss(0.0, 1e3), 1e-300, math.nan, math.inf, -0.1])
        case F.CPPTYPE_FLOAT:
            return rng.randint(-1000, 1000) / 8.0
        case F.CPPTYPE_INT64:
            return rng.randint(-(2**62), 2**62)
        case F.CPPTYPE_UINT64:
            return rng.randint(1, 2**64 - 1)
        case F.CPPTYPE_INT32:
            return rng.randint(-(2**31), 2**31 - 1) if "nano" not in field.name else 999_999_999
        case F.CPPTYPE_UINT32:
            return rng.randint(1, 2**32 - 1)
        case F.CPPTYPE_BOOL:
            return True
        case F.CPPTYPE_ENUM:
            assert field.enum_type is not None
            return rng.choice(field.enum_type.values).number
    text = "Größe 机 \x00\U0001f9f5"
    return text if field.type == F.TYPE_STRING else bytes(rng.randrange(256) for _ in range(40))


def recording(path: Path) -> Path:
    """Recording of two messages of every topic, each field filled."""
    rng = random.Random(0)
    writer = Writer(path, cell.scenario(path.parent), cell.NOW)
    for number, topic in enumerate(TOPICS):
        concrete = topic.at("one") if "{" in topic.key else topic
        for k in range(2):
            payload = filled(topic.type(), rng).SerializeToString()
            stamp = cell.NOW + 10 * number + k
            writer.write(concrete, payload, f"test-{k}", 2**32 - 1 - k, stamp, stamp - 7)
    writer.close()
    return path


def read_by_python(path: Path) -> Iterator[dict[str, Any]]:
    types = {topic.type.DESCRIPTOR.full_name: topic.type for topic in TOPICS}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            assert schema is not None
            content = base64.b64encode(message.data).decode()
            if schema.encoding == "protobuf":
                content = plain(types[schema.name].FromString(message.data))
            yield {
                "topic": channel.topic,
                "publisher": channel.metadata.get("publisher", ""),
                "sequence": message.sequence,
                "log_time": str(message.log_time),
                "publish_time": str(message.publish_time),
                "schema": schema.name,
                "message": content,
            }


def plain(message: Message) -> dict[str, Any]:
    """Fields that are set, as JavaScript's library prints them."""
    found = {}
    for field, value in message.ListFields():
        if _is_map(field):
            kind = _value_field(field)
            # By its descriptor, a map is a list of entries.
            entries = [{"key": key, "value": _printed(kind, each)} for key, each in value.items()]
            found[field.name] = entries
            continue
        values = value if field.is_repeated else [value]
        shown = [_printed(field, v) for v in values]
        found[field.name] = shown if field.is_repeated else shown[0]
    return found


def _printed(field: FieldDescriptor, value: Any) -> Any:
    match field.cpp_type:
        case F.CPPTYPE_MESSAGE:
            return plain(value)
        case F.CPPTYPE_INT64 | F.CPPTYPE_UINT64:
            return str(value)
        case F.CPPTYPE_ENUM:
            assert field.enum_type is not None
            return field.enum_type.values_by_number[value].name
        case F.CPPTYPE_DOUBLE | F.CPPTYPE_FLOAT if not math.isfinite(value):
            return "NaN" if math.isnan(value) else "Infinity" if value > 0.0 else "-Infinity"
    return base64.b64encode(value).decode() if isinstance(value, bytes) else value


def test_both_read_the_same_of_every_message(tmp_path: Path):
    path = recording(tmp_path / "all.mcap")
    ours, theirs = list(read_by_python(path)), run("read_recording.mjs", str(path))
    assert len(ours) == 2 * sum(topic.recorded for topic in TOPICS) + 1
    assert [row["topic"] for row in ours] == [row["topic"] for row in theirs]
    for one, other in zip(ours, theirs, strict=True):
        assert one == other, one["topic"]
