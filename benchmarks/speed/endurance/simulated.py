"""Runs back to back in simulated time, in one process."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.speed.endurance.samples import Sample, sample_of
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import FAILED, IDLE, REACHED, TaskRequest, TaskState
from stack import services
from stack.simulation.closed_loop import POLL_PERIOD, make_ready, with_emulated_arms
from stack.simulation.simulated_time import START, SimulatedStack, session_id

SAMPLE_PERIOD = 30 * SECOND
"""Simulated time between two samples [ns]."""
RESET_TIMEOUT = 5 * SECOND
"""Longest simulated time that a reset may take [ns]."""


class SimulatedOperation:
    """One stack whose rope goes to the goal and back to the start, again and again."""

    def __init__(self, scenario: Scenario) -> None:
        """Start the stack, with true nodes in place of the camera.

        Raises:
            RuntimeError: The cell does not become ready.
        """
        sensing = replace(scenario.sensing, source="truth")
        self._scenario = with_emulated_arms(replace(scenario, sensing=sensing))
        members = [services.build(n, self._scenario, session_id(n)) for n in services.NAMES]
        self._stack = SimulatedStack(members)
        self._stack.warm_up()
        if missing := make_ready(self._stack, self._scenario):
            raise RuntimeError(missing)
        self.runs = 0
        """Number of runs that reached their goal."""
        self.failures: list[str] = []
        """Runs that did not, in words."""

    def run_until(self, minutes: float, before: float) -> Iterator[list[Sample]]:
        """Run back to back, and yield samples of this process.

        Args:
            minutes: Simulated time of operation at the end, with that before [min].
            before: Simulated time of operation before this stack was started [min].
        """
        sampled = self._stack.now
        while self._minutes + before < minutes:
            self._run_once()
            if self._stack.now - sampled >= SAMPLE_PERIOD:
                sampled = self._stack.now
                yield list(self._samples(self._minutes + before))

    @property
    def _minutes(self) -> float:
        return (self._stack.now - START) / (60 * SECOND)

    def _samples(self, minutes: float) -> Iterator[Sample]:
        """Yield a sample of this process for each service, whose step times they hold."""
        for name in services.NAMES:
            times = self._stack.step_ms(name)
            yield sample_of(name, "self", minutes, float(np.percentile(times, 99)))
            times.clear()

    def _run_once(self) -> None:
        self._request(TaskRequest.START)
        task = self._wait((REACHED, FAILED), round(self._scenario.run.time_limit * SECOND))
        if task.state == REACHED:
            self.runs += 1
        else:
            at = f"{self._minutes:.1f} min"
            self.failures.append(f"{at}: {task.reason or 'the time limit has passed'}")
        self._request(TaskRequest.RESET)
        self._wait((IDLE,), RESET_TIMEOUT)

    def _request(self, action: TaskRequest.Action) -> None:
        request = TaskRequest(id=f"endurance-{self._stack.now}", action=action)
        self._stack.send(topics.TASK_REQUEST, request)
        # Until the request is handled the state is that of the run before.
        while self._task.last_request != request.id:
            self._stack.advance_to(self._stack.now + POLL_PERIOD)

    def _wait(self, states: tuple[int, ...], limit: int) -> TaskState:
        deadline = self._stack.now + limit
        while self._stack.now < deadline:
            self._stack.advance_to(self._stack.now + POLL_PERIOD)
            if self._task.state in states:
                break
        return self._task

    @property
    def _task(self) -> TaskState:
        task = self._stack.latest(topics.TASK_STATE)
        assert task is not None
        return task
