"""A recorded RGB-D camera that plays again at its own pace."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from services.camera.source import Shot
from shared import topics
from shared.configuration import ConfigurationError
from shared.messages import stamp_of
from shared.recording import Recording


class Playback:
    """Plays the colour and depth images of one camera."""

    def __init__(self, path: Path, camera: str, repeat: bool) -> None:
        """Opens the file.

        Raises:
            ConfigurationError: It cannot be read, or holds no whole exposure of the camera.
        """
        self._keys = tuple(
            topic.at(camera).key
            for topic in (topics.CAMERA_COLOR, topics.CAMERA_DEPTH, topics.CAMERA_CALIBRATION)
        )
        self._repeat = repeat
        try:
            self._recording = Recording.open(path)
        except ValueError as error:
            raise ConfigurationError(f"--recording {path}: {error}") from error
        self._shots = self._all()
        self._next = next(self._shots, None)
        if self._next is None:
            raise ConfigurationError(
                f"--recording {path}: no colour and depth of one stamp with a calibration "
                f"on {', '.join(self._keys)}"
            )
        self._begin: tuple[int, int] | None = None

    def newest(self, now: int) -> Shot | None:
        """The newest exposure that is due."""
        due = None
        while self._next is not None:
            if self._begin is None:
                self._begin = now, self._next.exposed
            began, first = self._begin
            if now - began < self._next.exposed - first:
                break
            due = self._next
            self._next = next(self._shots, None)
            if self._next is None and self._repeat:
                self._shots, self._begin = self._all(), None
                self._next = next(self._shots, None)
                break
        return due

    def close(self) -> None:
        """Has nothing to let go of."""

    def _all(self) -> Iterator[Shot]:
        color_key, depth_key, calibration_key = self._keys
        waiting: dict[int, dict[str, Any]] = {}
        calibration = None
        early: list[tuple[int, dict[str, Any]]] = []
        for entry in self._recording.messages(self._keys):
            message = entry.parse()
            if entry.key == calibration_key:
                calibration = message
            else:
                stamp = stamp_of(message)
                pair = waiting.setdefault(stamp, {})
                pair[entry.key] = message
                if len(pair) == 2:
                    early.append((stamp, waiting.pop(stamp)))
            if calibration is not None:
                # The first images may have been recorded before the first calibration.
                for stamp, whole in early:
                    yield Shot(whole[color_key], whole[depth_key], calibration, stamp)
                early.clear()
