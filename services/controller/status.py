"""Publication of task, parameters and result: the task on change, and all at a steady rate."""

from __future__ import annotations

from collections.abc import Iterator

from lariat.control.run.state_machine import RunState
from lariat.rope_controller import RopeController
from lariat.trajectory import SECOND
from services.controller.messages import parameters_message
from shared import topics
from shared.messages import RunResult, TaskState, goal_message
from shared.runtime.service import Publication

ACTIVE_TASK_PERIOD = SECOND // 5
"""Time between publications of the task while the arms are controlled [ns]."""
IDLE_TASK_PERIOD = SECOND
"""Time between publications of the task otherwise [ns]."""
PARAMETERS_PERIOD = SECOND // 10
"""Time between publications of the parameters [ns]."""
RESULT_PERIOD = SECOND
"""Time between publications of the result [ns]."""
_OPEN = (RunState.RUNNING, RunState.PAUSED, RunState.REACHED)
"""States in which the result of a run may still change."""


class StatusPublisher:
    """Status of the controller as messages."""

    def __init__(self, controller: RopeController) -> None:
        self._controller = controller
        self._task, self._progress = controller.task, controller.progress
        self._estimator = controller.rope.estimator
        self._sent: dict[str, int] = {}
        self._revision = 0
        self._ended: int | None = None
        self._state = RunState.IDLE
        self.slow_pauses = 0
        """Pauses that a slow computer caused, as the gateway counts them."""
        self._pauses_before: tuple[str, int] = "", 0
        """Run that goes on, and that count at its begin."""
        self._result = RunResult()
        """Result of the present or last run; nothing changes it once the run is over."""

    def due(self, now: int) -> Iterator[Publication]:
        """Messages that are due at `now` [ns]."""
        task = self._task
        if task.state in (RunState.RUNNING, RunState.PAUSED):
            self._ended = None
        elif self._ended is None:
            self._ended = now
            self._sent.pop("result", None)  # The result of a run is published at once.
        if task.state in _OPEN or self._state in (RunState.RUNNING, RunState.PAUSED):
            self._result = self._present_result(now)
        self._state = task.state
        period = ACTIVE_TASK_PERIOD if task.active else IDLE_TASK_PERIOD
        if task.revision != self._revision or self._due("task", now, period):
            self._revision = task.revision
            self._sent["task"] = now
            yield Publication(topics.TASK_STATE, self._task_state(now))
        if self._controller.arms_known and self._due("parameters", now, PARAMETERS_PERIOD):
            parameters = parameters_message(
                self._controller.rope.adaptation,
                now,
                self._estimator.innovation,
                adapts=task.adapts,
            )
            if (kept := self._estimator.state.plastic_curvature) is not None:
                parameters.plastic_curvature.extend(kept.ravel())
            yield Publication(topics.CONTROLLER_PARAMETERS, parameters)
        if task.run and self._due("result", now, RESULT_PERIOD):
            result = RunResult(stamp=now)
            result.MergeFrom(self._result)
            yield Publication(topics.RUN_RESULT, result)

    def _due(self, name: str, now: int, period: int) -> bool:
        if name in self._sent and now - self._sent[name] < period:
            return False
        self._sent[name] = now
        return True

    def _task_state(self, now: int) -> TaskState:
        task, progress = self._task, self._progress
        return TaskState(
            stamp=now,
            revision=task.revision,
            state=task.state.name,
            reason=str(task.reason),
            reason_code=task.reason.code.name,
            goal=goal_message(task.goal),
            goal_revision=task.goal_revision,
            reset_count=task.reset_count,
            restore_count=task.restore_count,
            replan_count=task.replan_count,
            run=task.run,
            run_started=task.run_started,
            settings=task.settings,
            last_request=task.last_request,
            refusal=task.refusal,
            error=progress.error,
            clearance=progress.take_clearance(),
            turns=self._estimator.turns,
            tension=self._controller.tension,
            angle_error=progress.angle_error,
            clearance_margin=task.clearance_margin,
            pace=task.pace,
        )

    def _present_result(self, now: int) -> RunResult:
        task, progress = self._task, self._progress
        if self._pauses_before[0] != task.run or self._pauses_before[1] > self.slow_pauses:
            self._pauses_before = task.run, self.slow_pauses
        return RunResult(
            run=task.run,
            reached=task.state is RunState.REACHED,
            duration=((self._ended or now) - task.run_started) / SECOND,
            error=progress.error,
            max_node_error=progress.max_node_error,
            angle_error=progress.angle_error,
            min_clearance=progress.min_clearance,
            replans=max(task.replan_count - progress.replans_before, 0),
            reason=str(task.reason),
            reason_code=task.reason.code.name,
            slow_pauses=self.slow_pauses - self._pauses_before[1],
        )
