"""Runs of the recorder: logged as they go, listed, and changed by requests."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from services.recorder.runs.recorded_run import RecordedRun
from services.recorder.runs.run_folder import RunFolder
from services.recorder.runs.run_log import RunLog
from services.recorder.runs.video_process import VideoProcess
from shared import topics
from shared.door import Door
from shared.messages import RunFile, RunList, RunListRequest, RunResult, TaskState
from shared.runtime.service import Publication

log = logging.getLogger(__name__)

MAX_SELECTED = 8
"""Largest number of runs that one request may name [-]."""


class Runs:
    """Runs of one folder of recordings."""

    def __init__(self, scenario: Scenario, recordings: Path, door: Door) -> None:
        self._door = door
        self._log = RunLog(scenario)
        self._folder = RunFolder(recordings, door)
        self._recorded = RecordedRun(recordings)
        self._video = VideoProcess()
        self._last_request = self._refusal = ""
        self._published: tuple[int, str] = (-1, "")
        self._publish_time = -SECOND

    def load(self) -> None:
        """List the runs of the folder."""
        self._folder.load(0)

    def take_task(self, task: TaskState) -> None:
        """Follow the task; the run before is final when another one begins."""
        if (final := self._log.take_task(task)) is not None:
            self._keep(final)

    def take_result(self, result: RunResult) -> None:
        """Take a result of the run, which is kept at its end."""
        if self._log.take_result(result) and (run := self._log.present):
            self._keep(run)

    def take_late_file(self, run: str, name: str) -> None:
        """Take the name of the recording of a run that was over before the file was open."""
        if self._log.take_late_file(run, name) and (present := self._log.present):
            self._keep(present)

    def step(
        self, requests: Sequence[RunListRequest], open_file: str, now: int
    ) -> Iterator[Publication]:
        """Carry out requests; publish the list on change and once a second.

        Curves, motion, pictures and videos are published on request.
        """
        if open_file:
            self._log.take_file(open_file)
        for request in requests:
            curves: list[RunFile] = []
            with self._door.guard(topics.RUN_LIST_REQUEST.key) as outcome:
                curves = self._carry_out(request, open_file)
            self._last_request, self._refusal = request.id, outcome.refusal
            for run in curves:
                run.curves.stamp = now
                yield Publication(topics.RUN_CURVES, run.curves)
        yield from self._recorded.take(now)
        yield from self._video.take(now)
        state = self._folder.revision, self._last_request
        if state != self._published or now - self._publish_time >= SECOND:
            # Trials of a campaign are listed by processes of their own.
            self._folder.load(now)
            state = self._folder.revision, self._last_request
            self._published, self._publish_time = state, now
            message = RunList(stamp=now, last_request=self._last_request, refusal=self._refusal)
            message.runs.extend(self._folder.summaries())
            yield Publication(topics.RUN_LIST, message)

    def close(self) -> None:
        """Keep the present run as it stands."""
        self._recorded.close()
        self._video.close()
        if (run := self._log.present) is not None:
            run.summary.over = True
            self._keep(run)

    def _carry_out(self, request: RunListRequest, open_file: str) -> list[RunFile]:
        if not 1 <= len(request.runs) <= MAX_SELECTED:
            raise ValueError(f"the request names {len(request.runs)} runs; 1 to {MAX_SELECTED}")
        match request.action:
            case RunListRequest.ANNOTATE:
                for id in request.runs:
                    self._folder.annotate(id, request.note, request.star)
            case RunListRequest.DELETE:
                for id in request.runs:
                    self._folder.delete(id, open_file)
            case RunListRequest.SEND_CURVES:
                return [self._folder.named(id) for id in request.runs]
            case RunListRequest.CANCEL_VIDEO:
                self._video.cancel()
            case (
                RunListRequest.SEND_MOTION | RunListRequest.SEND_PICTURE | RunListRequest.MAKE_VIDEO
            ):
                summary = self._folder.named(request.runs[0]).summary
                if not summary.over or open_file in summary.files:
                    raise ValueError(
                        f"{summary.id} is being recorded; wait until its file is closed"
                    )
                if request.action == RunListRequest.SEND_MOTION:
                    self._recorded.read_motion(summary)
                elif request.action == RunListRequest.SEND_PICTURE:
                    self._recorded.read_picture(summary, request.time)
                else:
                    self._video.start(summary, self._recorded.files(summary))
            case unknown:
                raise ValueError(f"there is no action {unknown}")
        return []

    def _keep(self, run: RunFile) -> None:
        try:
            self._folder.keep(run)
        except OSError as error:
            log.error("the run %s cannot be kept: %s", run.summary.id, error)
