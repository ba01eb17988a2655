"""Runs back to back of one stack in simulated time: to the goal, and back to the start."""

from __future__ import annotations

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import FAILED, IDLE, REACHED, TaskRequest, TaskState
from stack import services
from stack.simulation.closed_loop import POLL_PERIOD, make_ready, with_emulated_arms
from stack.simulation.simulated_time import SimulatedStack, session_id

RESET_TIMEOUT = 5 * SECOND
"""Longest simulated time that a reset may take [ns]."""


class RepeatedRuns:
    """One stack that is run and reset again and again."""

    def __init__(self, scenario: Scenario) -> None:
        """Start the stack.

        Raises:
            RuntimeError: The cell does not become ready.
        """
        scenario = with_emulated_arms(scenario)
        self._time_limit = round(scenario.run.time_limit * SECOND)
        members = [services.build(n, scenario, session_id(n)) for n in services.NAMES]
        self.stack = SimulatedStack(members)
        """The services."""
        self.stack.warm_up()
        if missing := make_ready(self.stack, scenario):
            raise RuntimeError(missing)

    def run(self) -> TaskState:
        """Run until the goal is reached or given up, and return the state of the task."""
        return self._request(TaskRequest.START, (REACHED, FAILED), self._time_limit)

    def reset(self) -> TaskState:
        """Return to the start."""
        return self._request(TaskRequest.RESET, (IDLE,), RESET_TIMEOUT)

    def _request(
        self, action: TaskRequest.Action, states: tuple[int, ...], limit: int
    ) -> TaskState:
        """Make a request, and step until it has led to one of some states or a time has passed."""
        request = TaskRequest(id=f"run-{self.stack.now}", stamp=self.stack.now, action=action)
        self.stack.send(topics.TASK_REQUEST, request)
        deadline = self.stack.now + limit
        while True:
            self.stack.advance_to(self.stack.now + POLL_PERIOD)
            task = self.stack.latest(topics.TASK_STATE)
            assert task is not None
            # Until the request is handled the state is that of the run before.
            handled = task.last_request == request.id and task.state in states
            if handled or self.stack.now >= deadline:
                return task
