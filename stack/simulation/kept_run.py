"""Entry of a simulated run in the list of runs of a folder of recordings."""

from __future__ import annotations

from pathlib import Path

from lariat.scenario import Scenario
from services.recorder.runs.run_folder import RunFolder
from services.recorder.runs.run_log import RunLog
from shared import topics
from shared.messages import RunResult, TaskState
from stack.simulation.simulated_time import Delivery


class KeptRun:
    """Tap that follows a run as the live recorder does, and lists it at its end."""

    def __init__(
        self, scenario: Scenario, recordings: Path, recording: Path | None, note: str
    ) -> None:
        """Follow no run yet.

        Args:
            scenario: Scenario of the run.
            recordings: Folder of recordings that lists the run; it need not exist.
            recording: Recording of the run; it is named where it lies in that folder.
            note: Note of the run.
        """
        self._log = RunLog(scenario)
        self._folder = RunFolder(recordings)
        self._note = note
        self._file = ""
        if recording and recording.resolve().is_relative_to(recordings.resolve()):
            self._file = str(recording.resolve().relative_to(recordings.resolve()))

    def __call__(self, delivery: Delivery) -> None:
        """Take a message of the run."""
        if delivery.key == topics.TASK_STATE.key:
            self._log.take_task(TaskState.FromString(delivery.payload))
            if self._file:
                self._log.take_file(self._file)
        elif delivery.key == topics.RUN_RESULT.key:
            self._log.take_result(RunResult.FromString(delivery.payload))

    def keep(self) -> None:
        """List the run, as it stands; nothing where none has begun.

        Raises:
            OSError: It cannot be written.
        """
        if (run := self._log.present) is not None:
            run.summary.over, run.summary.note = True, self._note
            self._folder.keep(run)
