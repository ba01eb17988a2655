"""Compares messages field by field, within the tolerances of their topic."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from shared.topics import Topic


@dataclass(frozen=True)
class Difference:
    """One field that differs from the recording, or a message that is not there exactly once."""

    topic: str
    sequence: int
    """Number of the message among its publisher's on this topic."""
    time: int
    """Receipt of the recorded message, or time of the step that should have sent it [ns]."""
    field: str
    """Dotted path with indices; empty when a whole message is concerned."""
    recorded: str
    replayed: str
    size: float = math.inf
    """Absolute difference of numbers, else infinite."""
    kind: str = "field"
    """`field`, or for a whole message: `extra` (published, not recorded), `lacks` (recorded, not
    published), `doubled`, `absent` (an input that the file lacks), `lost step` (no trace)."""


def field_differences(
    topic: Topic, recorded: Message, replayed: Message
) -> Iterator[tuple[str, str, str, float]]:
    """Yield path, both values and absolute difference of every field outside of its tolerance.

    A list of numbers yields only its largest difference.
    """
    for field in recorded.DESCRIPTOR.fields:
        tolerance = topic.tolerance.get(field.name, 0.0)
        a, b = getattr(recorded, field.name), getattr(replayed, field.name)
        yield from _value(field.name, _plain(field, a), _plain(field, b), tolerance)


def _plain(field: FieldDescriptor, value: Any) -> Any:
    """Return lists, dicts and scalars instead of protobuf's containers."""
    if _is_map(field):
        return dict(value)
    if field.is_repeated:
        return list(value)
    return value


def _is_map(field: FieldDescriptor) -> bool:
    kind = field.message_type
    return kind is not None and kind.GetOptions().map_entry


def _value(path: str, a: Any, b: Any, tolerance: float) -> Iterator[tuple[str, str, str, float]]:
    if isinstance(a, Message):
        for field in a.DESCRIPTOR.fields:
            x, y = getattr(a, field.name), getattr(b, field.name)
            yield from _value(f"{path}.{field.name}", _plain(field, x), _plain(field, y), tolerance)
    elif isinstance(a, Mapping):
        for key in sorted(set(a) | set(b)):
            here = f"{path}[{key}]"
            if key in a and key in b:
                yield from _value(here, a[key], b[key], tolerance)
            else:
                yield here, _shown(a.get(key, "none")), _shown(b.get(key, "none")), math.inf
    elif isinstance(a, list):
        yield from _list(path, a, b, tolerance)
    elif isinstance(a, int | float) and not isinstance(a, bool):
        difference = _distance(a, b)
        if difference > tolerance:
            yield path, _shown(a), _shown(b), difference
    elif a != b:
        yield path, _shown(a), _shown(b), math.inf


def _list(path: str, a: list, b: list, tolerance: float) -> Iterator[tuple[str, str, str, float]]:
    if len(a) != len(b):
        yield path, f"{len(a)} values", f"{len(b)} values", math.inf
    elif a and isinstance(a[0], float):
        x, y = np.array(a), np.array(b)
        with np.errstate(invalid="ignore"):
            distance = np.where((x == y) | (np.isnan(x) & np.isnan(y)), 0.0, np.abs(x - y))
        distance = np.where(np.isnan(distance), np.inf, distance)
        worst = int(np.argmax(distance))
        if distance[worst] > tolerance:
            yield f"{path}[{worst}]", _shown(a[worst]), _shown(b[worst]), float(distance[worst])
    else:
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            yield from _value(f"{path}[{k}]", x, y, tolerance)


def _distance(a: float, b: float) -> float:
    if a == b or (math.isnan(a) and math.isnan(b)):
        return 0.0
    difference = abs(a - b)
    return math.inf if math.isnan(difference) else difference


def _shown(value: Any) -> str:
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if isinstance(value, float):
        return f"{value:.9g}"
    text = str(value)
    return text if len(text) <= 60 else text[:57] + "…"
