"""Files of the recorder: one for each run, which begins while the cell is still idle.

A file is opened when the recorder starts and whenever a run has ended, so that it also holds the
time before its run. A file that cannot be written never stops the cell: `failure` gives the reason,
and the recorder tries again later.
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

AFTER_RUN_TIME = 2 * SECOND
"""Time for which recording goes on after a run has reached its goal or failed [ns]."""
IDLE_IMAGE_TIME = 30 * SECOND
"""Time after which an idle cell is recorded without images, until a run starts [ns]."""
RETRY_PERIOD = 10 * SECOND
"""Time between two attempts to open a file [ns]."""


class RunFiles:
    """Writer of one file after another into a folder."""

    def __init__(self, scenario: Scenario, options: RecorderOptions) -> None:
        self._scenario = scenario
        self._options = options
        self._writer: Writer | None = None
        self._is_first_file = True
        self._retry_time = 0
        self._open_time = 0
        self._run_end = 0
        self.run = ""
        """Name of the run in the file; empty while the cell is idle."""
        self.failure = ""
        """Reason why nothing is recorded; empty while a file is open."""

    @property
    def writer(self) -> Writer | None:
        """Writer of the open file; None if there is none."""
        return self._writer

    def write(
        self, topic: Topic, payload: bytes, publisher: str, sequence: int, received: int
    ) -> None:
        """Write a message to the open file, if there is one.

        Args:
            topic: Topic of the message.
            payload: Encoded message.
            publisher: Session id of the publisher.
            sequence: Number of the message, counted by its publisher.
            received: Time of receipt [ns].
        """
        self._open_if_due(received)
        if self._writer is None or (topic.large and self._is_long_idle(received)):
            return
        try:
            self._writer.write(topic, payload, publisher, sequence, received)
        except OSError as error:
            self._give_up(f"cannot write {self._writer.path}: {error}", received)

    def take_task(self, task: TaskState, now: int) -> None:
        """Open and close files by the state of the run; call it before writing the message."""
        over = task.state in (IDLE, REACHED, FAILED)
        if self.run and (task.state == IDLE or (task.run and task.run != self.run)):
            self._next_file(now)
        if self.run:
            self._run_end = (self._run_end or now) if over else 0
        elif not over:
            self.run, self._run_end = task.run or "unnamed", 0

    def tick(self, now: int) -> None:
        """Open a file if there is none, check the free space, flush the open file."""
        if self.run and self._run_end and now - self._run_end >= AFTER_RUN_TIME:
            self._next_file(now)
        self._open_if_due(now)
        if self._writer is None:
            return
        try:
            self._check_free_space()
            self._writer.flush(now)
        except OSError as error:
            self._give_up(f"cannot write {self._writer.path}: {error}", now)

    def close(self) -> None:
        """Close the open file; remove it if it holds only an idle cell after a run."""
        if self._writer is None:
            return
        writer, self._writer = self._writer, None
        try:
            writer.close()
            if not self.run and not self._is_first_file:
                writer.path.unlink()
        except OSError as error:
            self.failure = f"cannot close {writer.path}: {error}"

    def _is_long_idle(self, now: int) -> bool:
        return not self.run and now - self._open_time > IDLE_IMAGE_TIME

    def _open_if_due(self, now: int) -> None:
        if self._writer is None and now >= self._retry_time:
            self._open(now)

    def _check_free_space(self) -> None:
        free = shutil.disk_usage(self._options.folder).free / 1e9
        if free < self._options.least_free:
            raise OSError(
                f"only {free:.2f} GB are left on its disk; make room, or lower --least-free"
            )

    def _open(self, now: int) -> None:
        path = self._path(now)
        try:
            # Before the file is created: otherwise every attempt would leave a file on a full disk.
            path.parent.mkdir(parents=True, exist_ok=True)
            self._check_free_space()
            self._writer = Writer(path, self._scenario, now, {"time": "live"})
        except OSError as error:
            self._give_up(f"cannot record to {path.parent}: {error}", now)
            return
        self._open_time, self.failure = now, ""

    def _next_file(self, now: int) -> None:
        self.close()
        self.run, self._run_end, self._is_first_file = "", 0, False
        self._open(now)

    def _give_up(self, reason: str, now: int) -> None:
        self.failure, self._retry_time = reason, now + RETRY_PERIOD
        writer, self._writer = self._writer, None
        if writer is not None:
            # The index may not fit on the disk; `lariat repair` rebuilds it.
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
