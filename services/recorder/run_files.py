"""Files of the recorder: every message of a run with the seconds before it, few of an idle cell.

Messages wait in the pre-roll. While a run goes on or an arm moves, they pass from there to a file
in each step, at its begin states before images; otherwise they leave it by age, and few of them are
written to the idle cell's file. A recorder that falls behind leaves out images.

A file that cannot be written never stops the cell: `failure` gives the reason, and the recorder
tries again later.
"""

from __future__ import annotations

import logging
import os
import re
import shutil
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from services.recorder.options import RecorderOptions
from services.recorder.pre_roll import PreRoll
from services.recorder.private_folder import make_folder
from services.recorder.retention import IDLE_ENDING, Retention
from services.recorder.thinning import Thinning
from shared.bus import RawMessage
from shared.messages import FAILED, IDLE, REACHED, TaskState
from shared.recording import Writer
from shared.recording.layout import ORDERED_FROM

log = logging.getLogger(__name__)

Kind = Literal["run", "idle"]
"""Content of a file: every message, or the thinned ones of an idle cell."""

AFTER_RUN_TIME = 2 * SECOND
"""Time for which recording goes on after a run or the motion of an arm has ended [ns]."""
SYNC_PERIOD: dict[Kind, int] = {"run": SECOND, "idle": 10 * SECOND}
"""Longest time that a loss of power takes, beside that of the disk [ns]."""
CATCH_UP_TIME = SECOND
"""Time from a file's begin for which images of the pre-roll may wait [ns]."""
RETRY_PERIOD = 10 * SECOND
"""Time between two attempts to open a file [ns]."""
MAX_PRE_ROLL_SIZE = 2**28
"""Largest size of the messages that wait [bytes]."""
MAX_STEP_SIZE = 2**23
"""Size of the messages after which a step in time writes no more images [bytes]."""
LATE_STEP_TIME = SECOND // 10
"""Time since the step before from which a step is late [ns]: what it has written is lost with the
process until it is over, so that it writes less, and flushes."""


class RunFiles:
    """Writer of one file after another into a folder."""

    def __init__(self, scenario: Scenario, options: RecorderOptions) -> None:
        self._scenario = scenario
        self._options = options
        self._settings = scenario.recording
        self._pre_roll = PreRoll()
        self._thinning = Thinning()
        self._thinned: list[RawMessage] = []
        """Messages that the next step writes to the idle cell's file."""
        keep = options.keep
        self._retention = Retention(options.folder, None if keep is None else 1e9 * keep)
        self._writer: Writer | None = None
        self._kind: Kind = "run"
        self._former = ""
        """Name of the file that the open one continues."""
        self._start: int | None = None
        """Time of the first message or step [ns]."""
        self._open_time = self._latest = 0
        self._retry_time = 0
        self._run_end = 0
        self._moved = -AFTER_RUN_TIME
        """Time at which an arm was last seen moving [ns]."""
        self.run = ""
        """Name of the run in the file; empty while the cell is idle."""
        self._stepped: int | None = None
        """Time of the last step [ns]."""
        self.lateness = 0.0
        """Time since the step before, in units of `LATE_STEP_TIME`."""
        self.failure = ""
        """Reason why nothing is recorded; empty while a file is open."""
        self.late: tuple[str, str] | None = None
        """Run that was over before its file was open, and the file's name; None without one."""
        self.lost = 0
        """Number of messages of runs that were left out, since too many waited."""

    @property
    def writer(self) -> Writer | None:
        """Writer of the open file; None if there is none."""
        return self._writer

    def put(self, message: RawMessage) -> None:
        """Take a message, which is written by a later `tick`.

        Images are left out first where too many messages of a run wait.
        """
        size = self._pre_roll.size + len(message.payload)
        if self._kind == "run" and message.topic.large and size > MAX_PRE_ROLL_SIZE:
            self.lost += 1
            return
        # Times of receipt may be slightly out of order; log times must not be.
        self._latest = max(self._latest, message.received)
        if message.received < self._latest:
            message = message._replace(received=self._latest)
        self._pre_roll.put(message)
        if self._kind == "idle" and self._thinning.keeps(message):
            self._thinned.append(message)

    def take_task(self, task: TaskState, now: int) -> None:
        """Begin and end runs by the state of the task; call it before putting the message."""
        over = task.state in (IDLE, REACHED, FAILED)
        if self.run and (task.state == IDLE or (task.run and task.run != self.run)):
            self._end_run(now)
        if self.run:
            self._run_end = (self._run_end or now) if over else 0
        elif not over:
            self.run, self._run_end = task.run or "unnamed", 0

    def take_motion(self, now: int) -> None:
        """Note that an arm moves, which is recorded like a run."""
        self._moved = now

    def tick(self, now: int) -> None:
        """Write messages, begin and end files, check the free space, flush the open file."""
        if self._start is None:
            self._start = now
        self.lateness = (now - (self._stepped or now)) / LATE_STEP_TIME
        self._stepped = now
        # Arms that still move belong to the run: another file would hold its end once more.
        last = max(self._run_end, self._moved)
        if self.run and self._run_end and now - last >= AFTER_RUN_TIME:
            self._end_run(now)
        kind = self._wanted(now)
        if kind != self._kind or self._is_full(now):
            self._change_kind(kind, now)
        elif self._writer is None and now >= self._retry_time:
            self._open(now)
        self._write_due(now)
        if self._writer is None:
            return
        try:
            self._check_free_space()
            self._writer.flush(now, at_once=self.lateness >= 1.0)
        except OSError as error:
            self._give_up(f"cannot write {self._writer.path}: {error}", now)

    def close(self) -> None:
        """Write what waits, and close the open file; the log tells a patient launcher how far."""
        while (
            self._kind == "run" and self._writer is not None and self._pre_roll.size > MAX_STEP_SIZE
        ):
            log.info("saving the recording: %.1f MB left", self._pre_roll.size / 1e6)
            self._write(self._pre_roll.take_oldest(MAX_STEP_SIZE), self._open_time)
        self._close(self._open_time)

    def _wanted(self, now: int) -> Kind:
        """Kind of the file that the present messages belong to."""
        assert self._start is not None
        starting = now - self._start < self._settings.start_up * SECOND
        moving = now - self._moved < AFTER_RUN_TIME
        starting &= not self._former
        return "run" if self.run or moving or starting or self._options.always else "idle"

    def _is_full(self, now: int) -> bool:
        if self._writer is None:
            return False
        age = now - self._open_time
        return (
            age >= self._settings.longest_file * SECOND
            or self._writer.bytes >= self._settings.largest_file * 1e9
        )

    def _write_due(self, now: int) -> None:
        """Write what a step writes."""
        if self._kind == "idle":
            self._write_thinned(now)
            since = now - round(self._settings.pre_roll * SECOND)
            deque(self._pre_roll.take_older(since, MAX_PRE_ROLL_SIZE), maxlen=0)
            return
        # Without a file the messages of the last seconds wait for one.
        if self._writer is not None:
            # A recorder that is killed loses images of the pre-roll, never the begin of the run.
            begin = self._open_time + CATCH_UP_TIME
            states = [*self._pre_roll.take_states(begin, MAX_STEP_SIZE)]
            self._write(states, now)
            size = MAX_STEP_SIZE / max(1.0, self.lateness) ** 2
            size -= sum(len(message.payload) for message in states)
            self._write(self._pre_roll.take_oldest(size), now)
            if now - self._open_time >= CATCH_UP_TIME:
                self._write(self._without_images(), now)
        self.lost += sum(1 for _ in self._pre_roll.take_older(0, MAX_PRE_ROLL_SIZE))

    def _without_images(self) -> Iterator[RawMessage]:
        """Take what waits; images are lost."""
        for message in self._pre_roll.take_oldest(MAX_PRE_ROLL_SIZE):
            if message.topic.large:
                self.lost += 1
            else:
                yield message

    def _write_thinned(self, now: int) -> None:
        messages, self._thinned = self._thinned, []
        self._write(messages, now)

    def _write(self, messages: Iterable[RawMessage], now: int) -> None:
        for message in messages:
            if self._writer is None:
                continue
            try:
                self._writer.write(
                    message.topic,
                    message.payload,
                    message.publisher,
                    message.sequence,
                    message.received,
                    message.published,
                )
            except OSError as error:
                self._give_up(f"cannot write {self._writer.path}: {error}", now)

    def _end_run(self, now: int) -> None:
        if self._kind == "idle":
            # A step that came late meets the begin and the end of a run at once.
            self._change_kind("run", now)
            if self._writer is not None:
                self.late = self.run, self._writer.path.name
        self.run, self._run_end = "", 0
        self._close(now)

    def _change_kind(self, kind: Kind, now: int) -> None:
        self._close(now)
        self._kind = kind
        if now >= self._retry_time:
            self._open(now)

    def _close(self, now: int) -> None:
        """Close the open file; what waits belongs to it if it is the file of a run."""
        self._write_thinned(now)
        if self._writer is not None and self._kind == "run":
            self._write(self._pre_roll.take_oldest(float("inf")), now)
        if self._writer is None:
            return
        writer, self._writer = self._writer, None
        try:
            writer.close()
            if self._kind == "idle" and not writer.messages:
                writer.path.unlink()
            else:
                self._former = writer.path.name
        except OSError as error:
            self.failure = f"cannot close {writer.path}: {error}"

    def _check_free_space(self) -> None:
        free = shutil.disk_usage(self._options.folder).free / 1e9
        if free < self._options.least_free:
            raise OSError(
                f"less than {self._options.least_free:g} GB are left on its disk; make room, or "
                "have the oldest recordings deleted: lariat up --keep GB"
            )

    def _open(self, now: int) -> None:
        path = self._path(now)
        try:
            # Before the file is created: otherwise every attempt would leave a file on a full disk.
            make_folder(path.parent)
            self._retention.apply()
            self._check_free_space()
            self._writer = Writer(
                path,
                self._scenario,
                min(now, self._pre_roll.start or now),
                {
                    "time": "live",
                    "kind": self._kind,
                    "continues": self._former,
                    ORDERED_FROM: str(now + CATCH_UP_TIME),
                },
                sync_period=SYNC_PERIOD[self._kind],
            )
        except OSError as error:
            # Every attempt has a file of its own, and the log needs the reason once.
            self._give_up(f"cannot record to {path.parent}: {error.strerror or error}", now)
            return
        self._open_time, self.failure = now, ""

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
        ending = IDLE_ENDING if self._kind == "idle" else ".mcap"
        path, count = self._options.folder / f"{stem}{ending}", 1
        while os.path.lexists(path):
            count += 1
            path = self._options.folder / f"{stem}_{count}{ending}"
        return path
