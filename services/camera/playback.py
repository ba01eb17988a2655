"""Playback of a recorded RGB-D camera at its original pace."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lariat.configuration import ConfigurationError
from services.camera.source import Exposure
from shared import topics
from shared.messages import stamp_of
from shared.recording import Recording


class Playback:
    """Source that plays the images of one camera of an MCAP file."""

    def __init__(self, path: Path, camera: str, repeat: bool) -> None:
        self._keys = tuple(
            topic.at(camera).key
            for topic in (topics.CAMERA_COLOR, topics.CAMERA_DEPTH, topics.CAMERA_CALIBRATION)
        )
        self._repeat = repeat
        try:
            self._recording = Recording.open(path)
        except ValueError as error:
            raise ConfigurationError(f"--recording {path}: {error}") from error
        self._exposures = self._read()
        self._next = next(self._exposures, None)
        if self._next is None:
            raise ConfigurationError(
                f"--recording {path}: no colour and depth of one stamp with a calibration "
                f"on {', '.join(self._keys)}"
            )
        self._started: tuple[int, int] | None = None

    def newest(self, now: int) -> Exposure | None:
        """Return the newest exposure that is due."""
        due = None
        while self._next is not None:
            if self._started is None:
                self._started = now, self._next.time
            started, first = self._started
            if now - started < self._next.time - first:
                break
            due = self._next
            self._next = next(self._exposures, None)
            if self._next is None and self._repeat:
                self._exposures, self._started = self._read(), None
                self._next = next(self._exposures, None)
                break
        return due

    def close(self) -> None:
        """Do nothing: the file is not kept open."""

    def _read(self) -> Iterator[Exposure]:
        color_key, depth_key, calibration_key = self._keys
        waiting: dict[int, dict[str, Any]] = {}
        calibration = None
        uncalibrated: list[tuple[int, dict[str, Any]]] = []
        for entry, message in self._recording.decoded(self._keys):
            if entry.key == calibration_key:
                calibration = message
            else:
                stamp = stamp_of(message)
                pair = waiting.setdefault(stamp, {})
                pair[entry.key] = message
                if len(pair) == 2:
                    uncalibrated.append((stamp, waiting.pop(stamp)))
            if calibration is not None:
                # The first images may precede the first calibration.
                for stamp, images in uncalibrated:
                    yield Exposure(images[color_key], images[depth_key], calibration, stamp)
                uncalibrated.clear()
