"""Motion and pictures of a recorded run, read in a thread of its own."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np

from lariat.files.bounded_file import path_inside
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import (
    FAILED,
    IDLE,
    PAUSED,
    REACHED,
    RUNNING,
    ArmStates,
    RunMark,
    RunMotion,
    RunPicture,
    RunSummary,
    TaskState,
    chain,
    goal_of,
)
from shared.messages.validation import MAX_TEXT_LENGTH
from shared.recording import Recording
from shared.runtime.service import Publication

log = logging.getLogger(__name__)

SHAPE_PERIOD = SECOND // 15
"""Least time between two shapes of a motion [ns]."""
MAX_COORDINATES = 150_000
"""Most coordinates of a motion, beyond which shapes are left out [-]."""
MAX_WAITING = 16
"""Most readings that wait: who asks without end must not delay others for hours [-]."""
MAX_MARKS = 100
"""Most marks of a run [-]."""
AFTER_RUN = 2 * SECOND
"""Time after a run's end that its motion holds [ns]."""
STATES = {PAUSED: "paused", REACHED: "reached", FAILED: "failed", IDLE: "stopped"}
"""Marks of the states that a run goes to."""


class RecordedRun:
    """Reader of the run that people look at; what it has read is published by the next step."""

    def __init__(self, recordings: Path) -> None:
        self._recordings = recordings
        self._thread = ThreadPoolExecutor(1, "recorded run")
        self._waiting: list[Future[Publication]] = []
        self._picture_waiting: Future[Publication] | None = None

    def read_motion(self, run: RunSummary) -> None:
        """Begin to read the motion of a run."""
        if len(self._waiting) >= MAX_WAITING:
            raise ValueError(f"{MAX_WAITING} runs wait to be read; try again when one is shown")
        files = self.files(run)
        self._waiting.append(self._thread.submit(self._readable_motion, run, files))

    def read_picture(self, run: RunSummary, seconds: float) -> None:
        """Begin to read the picture of the camera nearest to a time."""
        if not abs(seconds) < 1e6:
            raise ValueError(f"{seconds} s is no time of a run")
        files = self.files(run)
        # Of the times that a slider runs through, the last one counts.
        if self._picture_waiting is not None:
            self._picture_waiting.cancel()
        self._picture_waiting = self._thread.submit(self._picture, run, files, seconds)
        self._waiting.append(self._picture_waiting)

    def files(self, run: RunSummary) -> list[Path]:
        """Return those recordings of a run that are left."""
        files = [path_inside(self._recordings, name) for name in run.files]
        files = [path for path in files if path.is_file()]
        if not files:
            raise ValueError(f"the recording of {run.id} has been deleted")
        return files

    def take(self, now: int) -> Iterator[Publication]:
        """Yield what has been read since the last call, stamped with `now` [ns]."""
        done = [future for future in self._waiting if future.done()]
        self._waiting = [future for future in self._waiting if future not in done]
        for future in done:
            if future.cancelled():
                continue
            if error := future.exception():
                log.warning("a recorded run cannot be read: %s", error)
                continue
            publication = future.result()
            publication.message.stamp = now
            yield publication

    def close(self) -> None:
        """End the thread."""
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _readable_motion(self, run: RunSummary, files: list[Path]) -> Publication:
        """Return the motion of a run; one without shapes that says why where it is unreadable."""
        try:
            return self._motion(run, files)
        except (OSError, ValueError) as error:
            mark = RunMark(text=f"cannot be read: {error}"[:MAX_TEXT_LENGTH])
            return Publication(topics.RUN_MOTION, RunMotion(run=run.id, marks=[mark]))

    def _motion(self, run: RunSummary, files: list[Path]) -> Publication:
        shapes: list[tuple[int, np.ndarray]] = []
        marks: list[RunMark] = []
        motion = RunMotion(run=run.id)
        end = 0
        state, needs_person = IDLE, False
        keys = (topics.ROPE_NODES.key, topics.TASK_STATE.key, topics.ARM_STATE.key)
        for path in files:
            for entry in Recording.open(path).messages(keys):
                time = entry.log_time
                if end and time > end + AFTER_RUN:
                    break
                if entry.key == topics.TASK_STATE.key:
                    task: TaskState = entry.parse()
                    if task.run != run.run or task.run_started != run.started:
                        continue
                    motion.goal[:] = goal_of(task.goal).curve.ravel()
                    if task.state != state:
                        text = "start" if not marks else STATES.get(task.state, "goes on")
                        reason = "" if task.state == RUNNING else f": {task.reason}"
                        marks.append(
                            RunMark(time=(time - run.started) / SECOND, text=text + reason)
                        )
                        end = 0 if task.state in (RUNNING, PAUSED) else time
                    state = task.state
                elif entry.key == topics.ARM_STATE.key:
                    arms: ArmStates = entry.parse()
                    if arms.needs_acknowledgement and marks and not needs_person:
                        text = f"hold: {arms.reason}"
                        marks.append(RunMark(time=(time - run.started) / SECOND, text=text))
                    needs_person = arms.needs_acknowledgement
                elif marks:
                    if shapes and time - shapes[-1][0] < SHAPE_PERIOD:
                        continue
                    nodes = chain(entry.parse().positions)
                    if len(nodes) > 1 and (not shapes or len(nodes) == len(shapes[0][1])):
                        shapes.append((time, nodes))
        motion.marks.extend(marks[:MAX_MARKS])
        if shapes:
            motion.node_count = len(shapes[0][1])
            most = max(2, MAX_COORDINATES // (3 * motion.node_count))
            shapes = shapes[:: -(-len(shapes) // most)]
            motion.time.extend((time - run.started) / SECOND for time, _ in shapes)
            motion.nodes.extend(np.concatenate([nodes for _, nodes in shapes]).ravel())
        return Publication(topics.RUN_MOTION, motion)

    def _picture(self, run: RunSummary, files: list[Path], seconds: float) -> Publication:
        """Return the picture nearest to a time; one without data where there is none."""
        best = RunPicture(run=run.id, time=float("nan"))
        instant = run.started + round(seconds * SECOND)
        for path in files:
            camera = ""
            for entry in Recording.open(path).messages():
                # Of several cameras, the one that comes first in the file.
                if not topics.CAMERA_COLOR.matches(entry.key) or entry.key != (camera or entry.key):
                    continue
                camera = entry.key
                time = (entry.log_time - run.started) / SECOND
                if not best.data or abs(time - seconds) <= abs(best.time - seconds):
                    best.time, best.data = time, entry.parse().data
                if entry.log_time > instant:
                    break
        return Publication(topics.RUN_PICTURE, best)
