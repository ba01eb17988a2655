"""What the controller says of itself, and how often."""

from __future__ import annotations

from collections.abc import Iterator

from services.controller.estimation.material_filter import MaterialFilter
from services.controller.estimation.state_estimator import StateEstimator
from services.controller.messages import STATES, goal_message, paper_parameters
from services.controller.paper.adaptation import PaperAdaptation
from services.controller.run.progress import ProgressMonitor
from services.controller.run.task import Task
from shared import topics
from shared.messages import Parameter, Parameters, RunResult, TaskState
from shared.service import SECOND, Publication


class StatusPublisher:
    """Task, parameters and result: on change where it matters, else at a steady rate."""

    def __init__(
        self,
        task: Task,
        monitor: ProgressMonitor,
        estimate: StateEstimator,
        adaptation: MaterialFilter | PaperAdaptation,
    ) -> None:
        self._task, self._monitor = task, monitor
        self._estimate, self._adaptation = estimate, adaptation
        self._sent: dict[str, int] = {}
        self._revision = 0
        self._over: int | None = None

    def due(self, now: int, *, arms_known: bool) -> Iterator[Publication]:
        """What is to be said at `now` [ns]."""
        task = self._task
        if task.state in ("running", "paused"):
            self._over = None
        elif self._over is None:
            self._over = now
            self._sent.pop("result", None)  # What came of a run is told at once.
        busy = task.state in ("running", "reached")
        period = SECOND // 5 if busy else SECOND
        if task.revision != self._revision or self._due("task", now, period):
            self._revision = task.revision
            self._sent["task"] = now
            yield Publication(topics.TASK_STATE, self._task_state(now))
        if arms_known and self._due("parameters", now, SECOND // 10):
            yield Publication(topics.CONTROLLER_PARAMETERS, self._parameters(now))
        if task.run and self._due("result", now, SECOND):
            yield Publication(topics.RUN_RESULT, self._result(now))

    def _due(self, what: str, now: int, period: int) -> bool:
        if what in self._sent and now - self._sent[what] < period:
            return False
        self._sent[what] = now
        return True

    def _task_state(self, now: int) -> TaskState:
        task, monitor = self._task, self._monitor
        return TaskState(
            stamp=now,
            revision=task.revision,
            state=STATES[task.state],
            reason=task.reason,
            goal=goal_message(task.goal),
            goal_revision=task.goal_revision,
            reset_count=task.reset_count,
            replan_count=task.replan_count,
            run=task.run,
            run_started=task.run_started,
            settings=task.settings,
            last_request=task.last_request,
            refusal=task.refusal,
            error=monitor.error,
            clearance=monitor.clearance,
            turns=self._estimate.turns,
        )

    def _parameters(self, now: int) -> Parameters:
        adaptation = self._adaptation
        if isinstance(adaptation, PaperAdaptation):
            return paper_parameters(adaptation, now, self._estimate.innovation)
        return Parameters(
            stamp=now,
            parameters=[
                Parameter(
                    name=e.name,
                    value=e.value,
                    standard_deviation=e.standard_deviation if self._task.adapts else 0.0,
                    unit=e.unit,
                )
                for e in adaptation.estimates
            ],
            prediction_error=self._estimate.innovation,
        )

    def _result(self, now: int) -> RunResult:
        task, monitor = self._task, self._monitor
        return RunResult(
            stamp=now,
            run=task.run,
            reached=task.state == "reached",
            duration=((self._over or now) - task.run_started) / SECOND,
            error=monitor.error,
            max_node_error=monitor.max_node_error,
            min_clearance=monitor.min_clearance,
            replans=max(task.replan_count - monitor.replans_before, 0),
            reason=task.reason,
        )
