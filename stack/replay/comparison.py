"""Compares messages field by field, within the tolerances of their topic."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message
from jaxtyping import Float64, Int
from numpy.typing import ArrayLike

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
    published), `doubled`, `absent` (an input that the file lacks), `lost step` (no trace); `median`
    for a field that differs too much in the median over the recording."""


class FieldDifference(NamedTuple):
    """One field whose values differ by more than is allowed."""

    path: str
    """Dotted path with indices."""
    recorded: str
    replayed: str
    size: float
    """Absolute difference of numbers, else infinite."""


class _Allowed(NamedTuple):
    absolute: float
    relative: float

    def excess(self, a: ArrayLike, b: ArrayLike) -> Float64[np.ndarray, "..."]:
        """Difference where it is not allowed, else 0; infinite where one value is no number."""
        x, y = np.asarray(a, float), np.asarray(b, float)
        with np.errstate(invalid="ignore"):
            difference = np.where((x == y) | (np.isnan(x) & np.isnan(y)), 0.0, np.abs(x - y))
            limit = self.absolute + self.relative * np.maximum(np.abs(x), np.abs(y))
        difference = np.where(np.isnan(difference), np.inf, difference)
        return np.where(difference <= limit, 0.0, difference)


def field_differences(
    topic: Topic, recorded: Message, replayed: Message
) -> Iterator[FieldDifference]:
    """Yield every field outside of the topic's tolerances.

    A list of numbers yields only its largest difference.
    """
    for field in recorded.DESCRIPTOR.fields:
        allowed = _Allowed(
            topic.tolerance.get(field.name, 0.0), topic.relative_tolerance.get(field.name, 0.0)
        )
        a, b = getattr(recorded, field.name), getattr(replayed, field.name)
        if _is_unspecified(field, a):
            continue  # A recording older than the field.
        if topic.pixel_tolerance and field.name == "data" and a != b:
            yield from _image(recorded, replayed, topic.pixel_tolerance)
        else:
            yield from _value(field.name, _plain(field, a), _plain(field, b), allowed)


def largest_differences(topic: Topic, recorded: Message, replayed: Message) -> dict[str, float]:
    """Largest absolute difference of every field that has a median tolerance."""
    sizes = {}
    for name in topic.median_tolerance:
        a, b = (np.array(getattr(message, name), float) for message in (recorded, replayed))
        if a.shape == b.shape:
            sizes[name] = float(np.max(np.abs(a - b), initial=0.0))
    return sizes


def _image(recorded: Any, replayed: Any, tolerance: float) -> Iterator[FieldDifference]:
    """Compare images by the fraction of their pixels that differ."""
    a, b = pixels(recorded), pixels(replayed)
    if a.shape != b.shape:
        yield FieldDifference("data", f"{a.shape}", f"{b.shape}", math.inf)
        return
    fraction = float(np.mean(np.any(a != b, axis=-1)))
    if fraction > tolerance:
        yield FieldDifference("data", "pixels", f"{100 * fraction:.3g} % differ", fraction)


def pixels(image: Any) -> Int[np.ndarray, "h w c"]:
    """Pixels of a compressed or raw image message."""
    if hasattr(image, "format"):
        # The dependencies of a talking client are without an image library.
        import cv2

        decoded = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_UNCHANGED)
        assert decoded is not None
        # The blocks of a JPEG spread one changed pixel by single grey levels.
        return decoded.reshape(*decoded.shape[:2], -1).astype(int) // 4
    data = np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, -1)
    return data.astype(int)


def _plain(field: FieldDescriptor, value: Any) -> Any:
    """Return lists, dicts and scalars instead of protobuf's containers."""
    if _is_map(field):
        return dict(value)
    if field.is_repeated:
        return list(value)
    return value


def _is_unspecified(field: FieldDescriptor, value: Any) -> bool:
    """Whether an enum says that the writer did not know the field."""
    kind = field.enum_type
    return kind is not None and value == 0 and kind.values_by_number[0].name == "UNSPECIFIED"


def _is_map(field: FieldDescriptor) -> bool:
    kind = field.message_type
    return kind is not None and kind.GetOptions().map_entry


def _value(path: str, a: Any, b: Any, allowed: _Allowed) -> Iterator[FieldDifference]:
    if isinstance(a, Message):
        for field in a.DESCRIPTOR.fields:
            x, y = getattr(a, field.name), getattr(b, field.name)
            yield from _value(f"{path}.{field.name}", _plain(field, x), _plain(field, y), allowed)
    elif isinstance(a, Mapping):
        for key in sorted(set(a) | set(b)):
            here = f"{path}[{key}]"
            if key in a and key in b:
                yield from _value(here, a[key], b[key], allowed)
            else:
                x, y = _shown(a.get(key, "none")), _shown(b.get(key, "none"))
                yield FieldDifference(here, x, y, math.inf)
    elif isinstance(a, list):
        yield from _list(path, a, b, allowed)
    elif isinstance(a, int) and not isinstance(a, bool) and not allowed.absolute:
        # Times in nanoseconds exceed the exact range of floating-point numbers.
        if a != b:
            yield FieldDifference(path, _shown(a), _shown(b), abs(a - b))
    elif isinstance(a, int | float) and not isinstance(a, bool):
        if excess := float(allowed.excess(a, b)):
            yield FieldDifference(path, _shown(a), _shown(b), excess)
    elif a != b:
        yield FieldDifference(path, _shown(a), _shown(b), math.inf)


def _list(path: str, a: list, b: list, allowed: _Allowed) -> Iterator[FieldDifference]:
    if len(a) != len(b):
        yield FieldDifference(path, f"{len(a)} values", f"{len(b)} values", math.inf)
    elif a and isinstance(a[0], float):
        excess = allowed.excess(a, b)
        worst = int(np.argmax(excess))
        if excess[worst]:
            x, y = _shown(a[worst]), _shown(b[worst])
            yield FieldDifference(f"{path}[{worst}]", x, y, float(excess[worst]))
    else:
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            yield from _value(f"{path}[{k}]", x, y, allowed)


def _shown(value: Any) -> str:
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if isinstance(value, float):
        return f"{value:.9g}"
    text = str(value)
    return text if len(text) <= 60 else text[:57] + "…"
