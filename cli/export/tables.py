"""Tables of a recording: one for each topic, a row for each message, a column for each value."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from lariat.trajectory import SECOND
from shared import topics
from shared.recording import Recording

MAX_VALUES = 2000
"""Most values of a repeated field that become columns; further ones are left out."""
OMITTED = (topics.TRACE, topics.VIEW_SCENE, topics.VIEW_POINTS, topics.VIEW_TRANSFORMS)
"""Topics without a table, beside those of images."""
NAME_FIELDS = ("arm", "name", "service")
"""Fields that name an element of a list; its columns carry the name in place of its index."""
AXES = {
    **dict.fromkeys(("position", "positions", "left_positions", "right_positions"), "xyz"),
    **dict.fromkeys(("nodes", "goal", "waypoints", "pull", "size", "normal"), "xyz"),
    **dict.fromkeys(("velocity", "linear_velocity", "angular_velocity"), "xyz"),
    **dict.fromkeys(
        ("orientation", "orientations", "left_orientations", "right_orientations"), "wxyz"
    ),
}
"""Components of the vectors and quaternions of a field, which follow each other in a message."""
MESSAGE, BYTES = FieldDescriptor.TYPE_MESSAGE, FieldDescriptor.TYPE_BYTES

Row = dict[str, Any]
"""Values by column."""


def write_csv(recording: Recording, folder: Path) -> str:
    """Write the tables as CSV files into a new folder; return one line about them."""
    by_topic = tables(recording)
    folder.mkdir(parents=True)
    for key, rows in by_topic.items():
        with (folder / f"{_file_name(key)}.csv").open("w", newline="") as stream:
            writer = csv.DictWriter(stream, columns(rows))
            writer.writeheader()
            writer.writerows(rows)
    return _summary(by_topic, folder)


def write_parquet(recording: Recording, folder: Path) -> str:
    """Write the tables as Parquet files into a new folder; return one line about them."""
    # Imported late: only this format needs it.
    import pyarrow
    import pyarrow.parquet

    by_topic = tables(recording)
    folder.mkdir(parents=True)
    for key, rows in by_topic.items():
        table = pyarrow.table({name: [row.get(name) for row in rows] for name in columns(rows)})
        pyarrow.parquet.write_table(table, folder / f"{_file_name(key)}.parquet")
    return _summary(by_topic, folder)


def tables(recording: Recording) -> dict[str, list[Row]]:
    """Return the rows of each topic, in the order of their log time.

    A row begins with `log_time` and `publish_time` [ns] and `time`, the seconds since the
    recording's first message. The names of the other columns are those of the message's fields;
    lists have a number, or the name of the element, behind a dot, and vectors their axis, as
    `positions.3.z` of node 3.
    """
    by_topic: dict[str, list[Row]] = {}
    start = None
    for entry in recording.messages():
        start = entry.log_time if start is None else start
        try:
            topic = entry.topic
        except KeyError:
            continue  # A topic of another version.
        if topic.large or any(t.matches(entry.key) for t in OMITTED):
            continue
        row: Row = {
            "log_time": entry.log_time,
            "publish_time": entry.publish_time,
            "time": (entry.log_time - start) / SECOND,
        }
        with recording.door.guard(f"{entry.key} in {recording.path}"):
            row.update(_values(entry.parse(), ""))
            by_topic.setdefault(entry.key, []).append(row)
    return by_topic


def columns(rows: list[Row]) -> list[str]:
    """Return the columns of rows that may lack some, in the order in which they appear."""
    return list(dict.fromkeys(name for row in rows for name in row))


def _values(message: Message, prefix: str) -> Iterator[tuple[str, Any]]:
    for field in message.DESCRIPTOR.fields:
        value, name = getattr(message, field.name), f"{prefix}{field.name}"
        if field.type == BYTES:
            continue
        if field.message_type is not None and field.message_type.GetOptions().map_entry:
            yield from ((f"{name}.{key}", value[key]) for key in sorted(value))
        elif field.is_repeated:
            for k, element in enumerate(value[:MAX_VALUES]):
                if field.type == MESSAGE:
                    yield from _values(element, f"{name}.{_element_name(element, k)}.")
                else:
                    yield f"{name}.{_component(field.name, k, len(value))}", element
        elif field.type == MESSAGE:
            yield from _values(value, f"{name}.")
        elif field.enum_type is not None:
            label = field.enum_type.values_by_number.get(value)
            yield name, label.name if label else str(value)
        else:
            yield name, value


def _component(field: str, k: int, count: int) -> str:
    """Return the end of a column: `x` of the only vector of a field, `3.z` of one of several."""
    axes = AXES.get(field, "")
    if not axes or count % len(axes):
        return str(k)
    vector, axis = divmod(k, len(axes))
    return axes[axis] if count == len(axes) else f"{vector}.{axes[axis]}"


def _element_name(element: Message, index: int) -> str:
    for name in NAME_FIELDS:
        if text := getattr(element, name, ""):
            return text
    return str(index)


def _file_name(key: str) -> str:
    return key.replace("/", "_")


def _summary(by_topic: dict[str, list[Row]], folder: Path) -> str:
    rows = sum(map(len, by_topic.values()))
    return f"{folder}: {len(by_topic)} tables with {rows} rows"
