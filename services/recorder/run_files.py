"""Which file messages go to: one for each run, from idle to its end.

A file begins when the recorder starts or a run has ended, so that every run has what came before
it. What cannot be written is said in `trouble` and tried again later; it never stops a cell.
"""

from __future__ import annotations

import re
import shutil
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from services.recorder.options import RecorderOptions
from shared.messages import FAILED, IDLE, REACHED, TaskState
from shared.recording import Writer
from shared.scenario import Scenario
from shared.service import SECOND
from shared.topics import Topic

LINGER = 2 * SECOND
"""A run that is reached or has failed is recorded for so long after [ns]."""
IDLE_IMAGES = 30 * SECOND
"""A cell that idles longer goes on being recorded, but without images, until a run starts [ns]."""
RETRY = 10 * SECOND
"""Time between two attempts to write where it did not work [ns]."""


class RunFiles:
    """Opens, fills and closes the files of a folder."""

    def __init__(self, scenario: Scenario, options: RecorderOptions) -> None:
        self._scenario = scenario
        self._options = options
        self._writer: Writer | None = None
        self._first = True
        self._retry_at = 0
        self._opened = 0
        self._over_since = 0
        self.run = ""
        """Name of the run in the file; empty while the cell idles."""
        self.trouble = ""
        """Why nothing is being recorded; empty otherwise."""

    @property
    def writer(self) -> Writer | None:
        """The file being written; None when that does not work."""
        return self._writer

    def write(
        self, topic: Topic, payload: bytes, publisher: str, sequence: int, received: int
    ) -> None:
        """Adds one message, where there is a file."""
        self._begin_if_due(received)
        if self._writer is None or (topic.large and self._idles(received)):
            return
        try:
            self._writer.write(topic, payload, publisher, sequence, received)
        except OSError as error:
            self._give_up(f"cannot write {self._writer.path}: {error}", received)

    def take_task(self, task: TaskState, now: int) -> None:
        """Ends the file when the run in it is over; to be told before the message is written."""
        over = task.state in (IDLE, REACHED, FAILED)
        if self.run and (task.state == IDLE or (task.run and task.run != self.run)):
            self._end(now)
        if self.run:
            self._over_since = (self._over_since or now) if over else 0
        elif not over:
            self.run, self._over_since = task.run or "unnamed", 0

    def tick(self, now: int) -> None:
        """Opens a file when there is none, flushes the open one each second."""
        if self.run and self._over_since and now - self._over_since >= LINGER:
            self._end(now)
        self._begin_if_due(now)
        if self._writer is None:
            return
        try:
            self._check_room()
            self._writer.flush(now)
        except OSError as error:
            self._give_up(f"cannot write {self._writer.path}: {error}", now)

    def close(self) -> None:
        """Ends the open file; one that holds nothing but idling after a run is removed."""
        if self._writer is None:
            return
        writer, self._writer = self._writer, None
        try:
            writer.close()
            if not self.run and not self._first:
                writer.path.unlink()
        except OSError as error:
            self.trouble = f"cannot end {writer.path}: {error}"

    def _idles(self, now: int) -> bool:
        return not self.run and now - self._opened > IDLE_IMAGES

    def _begin_if_due(self, now: int) -> None:
        if self._writer is None and now >= self._retry_at:
            self._begin(now)

    def _check_room(self) -> None:
        free = shutil.disk_usage(self._options.folder).free / 1e9
        if free < self._options.least_free:
            raise OSError(
                f"only {free:.2f} GB are left on its disk; make room, or lower --least-free"
            )

    def _begin(self, now: int) -> None:
        path = self._path(now)
        try:
            # Else every attempt would leave a file on a disk that has no room for it.
            path.parent.mkdir(parents=True, exist_ok=True)
            self._check_room()
            self._writer = Writer(path, self._scenario, now, {"time": "live"})
        except OSError as error:
            self._give_up(f"cannot record to {path.parent}: {error}", now)
            return
        self._opened, self.trouble = now, ""

    def _end(self, now: int) -> None:
        self.close()
        self.run, self._over_since, self._first = "", 0, False
        self._begin(now)

    def _give_up(self, reason: str, now: int) -> None:
        self.trouble, self._retry_at = reason, now + RETRY
        writer, self._writer = self._writer, None
        if writer is not None:
            # When its index does not fit either, `lariat repair` makes one.
            with suppress(OSError):
                writer.close()

    def _path(self, now: int) -> Path:
        at = datetime.fromtimestamp(now / SECOND, UTC)
        name = re.sub(r"[^A-Za-z0-9_.-]+", "-", self._scenario.name)
        stem = f"{at:%Y-%m-%d_%H-%M-%S}_{name}"
        path, count = self._options.folder / f"{stem}.mcap", 1
        while path.exists():
            count += 1
            path = self._options.folder / f"{stem}_{count}.mcap"
        return path
