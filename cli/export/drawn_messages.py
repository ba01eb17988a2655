"""Messages of a recording with the drawing of the cell, also where the recording has none."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lariat.trajectory import SECOND
from services.recorder.view.cell_view import CellView
from shared import topics
from shared.recording import Recording

DRAWING_PERIOD = SECOND // 30
"""Time between two drawings [ns]."""
_DRAWINGS = (
    topics.VIEW_SCENE,
    topics.VIEW_POINTS,
    topics.VIEW_TRANSFORMS,
    topics.VIEW_JOINTS,
)


@dataclass(frozen=True)
class DrawnMessage:
    """Decoded message."""

    key: str
    """Key of its topic."""
    message: Any
    """The message."""
    log_time: int
    """Time of receipt [ns]."""
    publish_time: int
    """Time of sending, by the publisher's clock [ns]."""


def drawn_messages(recording: Recording) -> Iterator[DrawnMessage]:
    """Yield the messages of a recording in the order of their log time, and what is drawn of them.

    A drawing that the recording holds is taken from it, unless it is of a version that has no
    frames.
    """
    has_drawing = any(True for _ in recording.messages([topics.VIEW_TRANSFORMS.key]))
    with tempfile.TemporaryDirectory() as folder:
        view = None if has_drawing else CellView(recording.scenario(Path(folder)))
        drawn = -DRAWING_PERIOD
        for entry, message in recording.decoded():
            if not has_drawing and any(topic.matches(entry.key) for topic in _DRAWINGS):
                continue
            yield DrawnMessage(entry.key, message, entry.log_time, entry.publish_time)
            if view is None:
                continue
            with recording.door.guard(f"the drawing of {entry.key} in {recording.path}"):
                view.take(entry.key, entry.payload)
                if entry.log_time - drawn >= DRAWING_PERIOD:
                    drawn = entry.log_time
                    for topic, drawing in view.draw(drawn):
                        yield DrawnMessage(topic.key, drawing, drawn, drawn)
