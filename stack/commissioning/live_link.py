"""Running stack of the cell on the bus, as the checklist sees it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from lariat.scenario import Scenario, Shape
from shared import topics
from shared.messages import ArmCommand, ArmStates, TaskRequest, TaskState
from shared.topics import Topic
from stack.client import POLL_PERIOD, Client
from stack.commissioning.checks import REQUIRED_SERVICES
from stack.goal_message import goal_message

HEARD = (
    topics.TASK_STATE,
    topics.ROPE_NODES,
    *(topics.HEALTH.at(name) for name in REQUIRED_SERVICES),
)
"""Topics whose newest message is kept."""


class LiveLink:
    """Link to a running stack through a client."""

    def __init__(
        self, client: Client, scenario: Scenario, poll: Callable[[], object] = lambda: None
    ) -> None:
        """Listen to the stack.

        Args:
            client: Client of the running stack.
            scenario: The cell.
            poll: Called again and again while the stack is observed.
        """
        self.client, self._scenario, self._poll = client, scenario, poll
        self._arms = client.bus.subscribe(topics.ARM_STATE)
        self._heard = [client.bus.subscribe(topic) for topic in HEARD]
        self._newest: dict[str, Any] = {}

    def latest(self, topic: Topic) -> Any | None:
        self._listen()
        return self._newest.get(topic.key)

    def observe(self, until: Callable[[ArmStates], bool], seconds: float) -> list[ArmStates]:
        self._arms.take()  # What came before does not count.
        states: list[ArmStates] = []
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._listen()
            self._poll()
            for _, item in self._arms.take():
                states.append(item.message)
                if until(item.message):
                    return states
            time.sleep(POLL_PERIOD)
        return states

    def command(self, action: ArmCommand.Action) -> ArmStates:
        return self.client.command_arms(action)

    def request(self, action: TaskRequest.Action) -> TaskState:
        state = self.client.request_task(action)
        self._newest[topics.TASK_STATE.key] = state
        return state

    def set_goal(self, shape: Shape) -> None:
        goal = goal_message(self._scenario, shape, self.client)
        self.client.request_task(TaskRequest.SET_GOAL, goal=goal)

    def _listen(self) -> None:
        for subscription in self._heard:
            for key, item in subscription.take():
                self._newest[key] = item.message
