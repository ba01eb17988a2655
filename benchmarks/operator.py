"""Person at a running stack: watches it, starts runs, acknowledges its stops and lets it go on."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

from shared import topics
from shared.messages import (
    IDLE,
    REACHED,
    RUNNING,
    ArmCommand,
    ArmStates,
    Health,
    StackState,
    TaskRequest,
    TaskState,
)
from stack.client import Client, RequestFailed

POLL_PERIOD = 0.01
"""Time between two looks at the bus [s]."""
RESET_TIMEOUT = 10.0
"""Longest wait for a reset [s]."""


class DeadlineMissed(RuntimeError):
    """A condition did not become true in time."""


class Operator:
    """Newest messages of a stack, and a person's answers to them."""

    def __init__(self, client: Client) -> None:
        self.client = client
        bus = client.bus
        self._arm, self._task = bus.subscribe(topics.ARM_STATE), bus.subscribe(topics.TASK_STATE)
        self._health, self._stack = bus.subscribe(topics.HEALTH), bus.subscribe(topics.STACK_STATE)
        self.states: list[ArmStates] = []
        """Messages of the gateway since they were last cleared."""
        self.task = TaskState()
        """Newest message of the controller."""
        self.stack = StackState()
        """Newest message of the launcher."""
        self.health: dict[str, Health] = {}
        """Newest health of each service."""
        self.stops: list[str] = []
        """Reasons of the stops that were acknowledged."""

    @property
    def arms(self) -> ArmStates:
        """Newest message of the gateway."""
        return self.states[-1] if self.states else ArmStates()

    def update(self) -> None:
        """Take the messages that have come in."""
        self.states += [item.message for _, item in self._arm.take()]
        for _, item in self._task.take():
            self.task = item.message
        for _, item in self._stack.take():
            self.stack = item.message
        for _, item in self._health.take():
            self.health[item.message.service] = item.message

    def wait_until(
        self, condition: Callable[[], bool], seconds: float, failure: str, goes_on: bool = False
    ) -> None:
        """Wait for a condition of what the stack says; `goes_on` acknowledges stops meanwhile.

        A busy machine makes a cell hold.
        """
        deadline = time.monotonic() + seconds
        while True:
            self.update()
            if condition():
                return
            if time.monotonic() > deadline:
                arms, task = self.arms, self.task
                mode = f"arms {ArmStates.Mode.Name(arms.mode)} ({arms.cause}: {arms.reason})"
                raise DeadlineMissed(f"{failure}; {mode}, task {task.state}: {task.reason}")
            if goes_on and (self.arms.needs_acknowledgement or self.arms.needs_resume):
                self.go_on()
            time.sleep(POLL_PERIOD)

    def go_on(self) -> None:
        """Acknowledge a stop and resume; refused while the arms are still being made ready."""
        with suppress(RequestFailed):
            state = self.client.newest_arm_state()
            if state.needs_acknowledgement:
                self.stops.append(state.reason)
                self.client.command_arms(ArmCommand.ACKNOWLEDGE)
            self.client.command_arms(ArmCommand.RESUME)

    def run_to_goal(self, seconds: float) -> None:
        """Start a run, anew where a stop has ended it, and wait until it is at the goal."""
        self.task = TaskState()

        def reached() -> bool:
            stands = self.arms.needs_acknowledgement or self.arms.needs_resume
            if self.task.state not in (RUNNING, REACHED) and not stands:
                with suppress(RequestFailed):
                    self.task = self.client.request_task(TaskRequest.START)
            return self.task.state == REACHED

        self.wait_until(reached, seconds, "the goal is not reached", goes_on=True)

    def run_and_reset(self, seconds: float) -> str:
        """Run to the goal and return to the start; return why the goal was not reached in time."""
        failure = ""
        self.states.clear()
        try:
            self.run_to_goal(seconds)
        except DeadlineMissed as missed:
            failure = str(missed)
        with suppress(RequestFailed, DeadlineMissed):
            self.reset()
        return failure

    def reset(self) -> None:
        """Reset the run, and wait until the cell is idle."""
        self.task = self.client.request_task(TaskRequest.RESET)
        self.wait_until(lambda: self.task.state == IDLE, RESET_TIMEOUT, "no reset", goes_on=True)
