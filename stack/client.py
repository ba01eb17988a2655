"""Talking to a running stack: a request, and the answer in its owner's state.

Nothing is latched on the bus. A request carries an id; the owner publishes the id that it handled
last, with the reason when it refused.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from shared import bus as buses
from shared import topics
from shared.bus import HUB, Bus, BusOptions, Publisher, Subscription
from shared.clock import SystemClock
from shared.messages import ArmCommand, ArmStates, TaskRequest, TaskState
from shared.service import SECOND

JOIN_PATIENCE = 1.5
"""Longest wait for the hub [s]."""
PATIENCE = 3.0
"""Longest wait for an answer [s]."""
EXPIRY = 2 * SECOND
"""Age at which a command to an arm is void [ns]."""


@dataclass(frozen=True)
class Cell:
    """Which stack to talk to."""

    connect: tuple[str, ...] = (HUB,)
    """Where its hub or router is."""
    namespace: str = "cell"
    """Name of the cell on the bus."""
    mode: Literal["peer", "client"] = "peer"
    """A client talks through a router."""
    settings: Path | None = None
    """A JSON object of further Zenoh settings by their path: TLS, user, password."""


class Unanswered(RuntimeError):
    """The stack did not do what it was asked; one line that says why."""


@contextmanager
def open(cell: Cell) -> Iterator[Conversation]:
    """A conversation with a running stack.

    Raises:
        Unreachable: There is none.
    """
    options = BusOptions(
        namespace=cell.namespace,
        connect=cell.connect,
        listen=() if cell.mode == "client" else ("tcp/127.0.0.1:0",),
        mode=cell.mode,
        settings=cell.settings,
    )
    name = f"lariat-{secrets.token_hex(4)}"
    with buses.open(options, name, timeout=JOIN_PATIENCE) as bus:
        yield Conversation(bus, name)


class Conversation:
    """Requests and their answers."""

    def __init__(self, bus: Bus, name: str) -> None:
        self.bus = bus
        self._name = name
        self._count = 0
        self._clock = SystemClock()

    def task(self, action: TaskRequest.Action, **fields: Any) -> TaskState:
        """Asks the controller; its state after that.

        Raises:
            Unanswered: It refused, or said nothing.
        """
        states = self.bus.subscribe(topics.TASK_STATE)
        requests = self._heard(topics.TASK_REQUEST)
        # Somebody listens, but perhaps only the recorder so far: who speaks to us is connected.
        self.wait(states, lambda _: True, "the controller says nothing")
        request = TaskRequest(id=self.next_id(), stamp=self._clock.now(), action=action, **fields)
        requests.put(request)
        return self._answer(states, request.id, "controller")

    def arm(self, action: ArmCommand.Action, **fields: Any) -> ArmStates:
        """Commands the gateway; its state after that.

        Raises:
            Unanswered: It refused, or said nothing.
        """
        states = self.bus.subscribe(topics.ARM_STATE)
        commands = self._heard(topics.ARM_COMMAND)
        before: ArmStates = self.wait(states, lambda _: True, "the robot gateway says nothing")
        command = ArmCommand(
            id=self.next_id(),
            stamp=self._clock.now(),
            boot=before.boot,
            # By the gateway's own clock, which need not be this machine's.
            expires=before.stamp + EXPIRY,
            action=action,
            **fields,
        )
        commands.put(command)
        return self._answer(states, command.id, "robot gateway")

    def next_id(self) -> str:
        """An id that no other request has."""
        self._count += 1
        return f"{self._name}-{self._count}"

    def wait(self, states: Subscription, condition: Callable[[Any], bool], otherwise: str) -> Any:
        """The first message that meets a condition.

        Raises:
            Unanswered: None came in time; it says `otherwise`.
        """
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            for _, item in states.take():
                if condition(item.message):
                    return item.message
            time.sleep(0.005)
        raise Unanswered(f"{otherwise}; `lariat status` shows who runs")

    def _answer(self, states: Subscription, request: str, owner: str) -> Any:
        def handled(state: TaskState | ArmStates) -> bool:
            last = state.last_request if isinstance(state, TaskState) else state.last_command
            return last == request

        state = self.wait(states, handled, f"the {owner} has not answered in {PATIENCE:g} s")
        if state.refusal:
            raise Unanswered(f"refused: {state.refusal}")
        return state

    def _heard(self, topic: topics.Topic) -> Publisher:
        """A publisher that somebody listens to: who comes later hears nothing of it."""
        publisher = self.bus.publisher(topic)
        deadline = time.monotonic() + PATIENCE
        while not publisher.heard:
            if time.monotonic() > deadline:
                raise Unanswered(f"nobody takes {topic.key}; `lariat status` shows who runs")
            time.sleep(0.005)
        return publisher
