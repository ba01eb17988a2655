"""Log of the run that goes on: its result and curves, from the messages of the controller."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime

from lariat.configuration import MAX_REASON_LENGTH
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared.history import History
from shared.messages import (
    IDLE,
    PAUSED,
    RUNNING,
    RunCurves,
    RunFile,
    RunResult,
    RunSummary,
    TaskState,
)
from shared.version import version

MAX_ROWS = 600
"""Largest number of rows of a run's curves [-]."""
MAX_NAME_LENGTH = 200
"""Length after which a run's name is cut [characters]."""
MAX_WORD_LENGTH = 60
"""Largest length of a scenario's or a run's name in the id of a run [characters]."""


class RunLog:
    """Follower of the present run."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._history = History(2, MAX_ROWS)
        self._state = IDLE
        self._summary = RunSummary()

    @property
    def present(self) -> RunFile | None:
        """Run that goes on, or the last one, with its curves; None before the first."""
        if not self._summary.id:
            return None
        time, error, clearance = self._history.columns
        curves = RunCurves(run=self._summary.id, time=time, error=error, clearance=clearance)
        return RunFile(summary=self._summary, curves=curves)

    def take_task(self, task: TaskState) -> RunFile | None:
        """Take a state of the task."""
        final, summary = None, self._summary
        name = task.run[:MAX_NAME_LENGTH]
        if name and (summary.run, summary.started) != (name, task.run_started):
            final = self.present if summary.over else None
            self._begin(name, task.run_started)
        self._state = task.state
        if task.run and task.state in (RUNNING, PAUSED):
            clearance = task.clearance if math.isfinite(task.clearance) else -1.0
            seconds = (task.stamp - task.run_started) / SECOND
            self._history.add(seconds, task.error, clearance)
        return final

    def take_result(self, result: RunResult) -> bool:
        """Take a result of the run."""
        summary = self._summary
        if not summary.id or result.run[:MAX_NAME_LENGTH] != summary.run:
            return False
        ended = self._state not in (RUNNING, PAUSED) and not summary.over
        summary.over |= ended
        summary.duration, summary.reached = result.duration, result.reached
        summary.error, summary.max_node_error = result.error, result.max_node_error
        summary.min_clearance, summary.replans = result.min_clearance, result.replans
        summary.reason = result.reason[:MAX_REASON_LENGTH]
        return ended

    def take_file(self, name: str) -> None:
        """Take the name of the recording that is open while the run goes on."""
        if self._summary.id and not self._summary.over and name not in self._summary.files:
            self._summary.files.append(name)

    def take_late_file(self, run: str, name: str) -> bool:
        """Take the name of the recording of a run that was over before the file was open."""
        missing = self._summary.run == run[:MAX_NAME_LENGTH] and not self._summary.files
        if missing:
            self._summary.files.append(name)
        return missing

    def _begin(self, name: str, started: int) -> None:
        self._history.clear()
        at = datetime.fromtimestamp(started / SECOND, UTC)
        words = (self._scenario.name, name)
        names = [re.sub(r"[^A-Za-z0-9.-]+", "-", word)[:MAX_WORD_LENGTH] for word in words]
        self._summary = RunSummary(
            id="_".join((f"{at:%Y-%m-%d_%H-%M-%S}", *names)),
            scenario=self._scenario.name,
            run=name,
            started=started,
            min_clearance=math.inf,
            method=self._scenario.control.method,
            version=version(),
        )
