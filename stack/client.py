"""Client of a running stack: sends a request and waits for the answer in its owner's state.

Nothing is latched on the bus. A request carries an id; the owner of the state publishes the id that
it handled last, with a reason when it refused.
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
from shared.bus import DEFAULT_HUB, Bus, BusOptions, Publisher, Subscription
from shared.messages import ArmCommand, ArmStates, TaskRequest, TaskState
from shared.runtime.clock import SystemClock
from stack.credentials.local_secret import find_local_secret

JOIN_TIMEOUT = 1.5
"""Longest wait for the bus' hub [s]."""
ANSWER_TIMEOUT = 3.0
"""Longest wait for an answer [s]."""
POLL_PERIOD = 0.005
"""Time between two looks for an answer [s]."""


@dataclass(frozen=True)
class Cell:
    """Address of a stack on the bus."""

    connect: tuple[str, ...] = (DEFAULT_HUB,)
    """Zenoh endpoints of its hub or router."""
    namespace: str = "cell"
    """Name of the cell on the bus."""
    mode: Literal["peer", "client"] = "peer"
    """Zenoh mode: a client talks through a router."""
    settings: Path | None = None
    """JSON file of further Zenoh settings by their path, e.g. one that `lariat certs` made; by
    default the secret of this user's stack on this machine."""

    @property
    def bus(self) -> BusOptions:
        """Options with which a process joins its bus."""
        return BusOptions(
            namespace=self.namespace,
            connect=self.connect,
            listen=() if self.mode == "client" else ("tcp/127.0.0.1:0",),
            mode=self.mode,
            settings=self.settings or find_local_secret(self.connect),
        )


class RequestFailed(RuntimeError):
    """A request was refused or not answered; the text is one line that says why."""


@contextmanager
def connect(cell: Cell) -> Iterator[Client]:
    """Client connected to a running stack.

    Raises:
        Unreachable: No stack runs at that address.
    """
    name = f"lariat-{secrets.token_hex(4)}"
    with buses.open(cell.bus, name, timeout=JOIN_TIMEOUT) as bus:
        yield Client(bus, name)


class Client:
    """Sender of requests that returns their answers."""

    def __init__(self, bus: Bus, name: str) -> None:
        self.bus = bus
        self._name = name
        self._count = 0
        self._clock = SystemClock()

    def request_task(self, action: TaskRequest.Action, **fields: Any) -> TaskState:
        """State of the task after the controller handled a request.

        Args:
            action: The request.
            fields: Further fields of `TaskRequest`.

        Raises:
            RequestFailed: The controller refused, or did not answer.
        """
        states = self.bus.subscribe(topics.TASK_STATE)
        requests = self.matched_publisher(topics.TASK_REQUEST)
        # The matched subscriber may be the recorder alone; a state shows that the controller is
        # connected as well.
        self.wait(states, lambda _: True, "the controller publishes no state")
        request = TaskRequest(id=self.next_id(), stamp=self._clock.now(), action=action, **fields)
        requests.put(request)
        return self._answer(states, request.id, "controller")

    def command_arms(self, action: ArmCommand.Action, **fields: Any) -> ArmStates:
        """State of the arms after the gateway handled a command.

        Args:
            action: The command.
            fields: Further fields of `ArmCommand`.

        Raises:
            RequestFailed: The gateway refused, or did not answer.
        """
        states = self.bus.subscribe(topics.ARM_STATE)
        command = self.send_to_arms(action, self.newest_arm_state(states), **fields)
        return self._answer(states, command, "robot gateway")

    def newest_arm_state(self, states: Subscription | None = None) -> ArmStates:
        """State of the arms.

        Args:
            states: Subscription to take it from; by default a new one.

        Raises:
            RequestFailed: The gateway publishes none.
        """
        states = states or self.bus.subscribe(topics.ARM_STATE)
        return self.wait(states, lambda _: True, "the robot gateway publishes no state")

    def send_to_arms(self, action: ArmCommand.Action, shown: ArmStates, **fields: Any) -> str:
        """Send a command to the gateway, and return its id without waiting for the answer.

        Args:
            action: The command.
            shown: State that the person saw.
            fields: Further fields of `ArmCommand`.

        Raises:
            RequestFailed: No gateway is connected.
        """
        command = ArmCommand(
            id=self.next_id(),
            stamp=self.now(),
            boot=shown.boot,
            # Commands expire by the gateway's clock, which may differ from this machine's.
            answers=shown.stamp,
            session=shown.next_session,
            action=action,
            **fields,
        )
        self.matched_publisher(topics.ARM_COMMAND).put(command)
        return command.id

    def now(self) -> int:
        """Time of this machine [ns]."""
        return self._clock.now()

    def next_id(self) -> str:
        """Unique id of a new request."""
        self._count += 1
        return f"{self._name}-{self._count}"

    def wait(self, states: Subscription, condition: Callable[[Any], bool], otherwise: str) -> Any:
        """First message that meets a condition.

        Args:
            states: Subscription to look in.
            condition: Predicate of the message.
            otherwise: Text of the error when no such message comes in time.

        Raises:
            RequestFailed: None came within `ANSWER_TIMEOUT`.
        """
        deadline = time.monotonic() + ANSWER_TIMEOUT
        while time.monotonic() < deadline:
            for _, item in states.take():
                if condition(item.message):
                    return item.message
            time.sleep(POLL_PERIOD)
        raise RequestFailed(f"{otherwise}; `lariat status` shows which processes run")

    def _answer(self, states: Subscription, request: str, owner: str) -> Any:
        def handled(state: TaskState | ArmStates) -> bool:
            last = state.last_request if isinstance(state, TaskState) else state.last_command
            return last == request

        silent = f"the {owner} has not answered within {ANSWER_TIMEOUT:g} s"
        state = self.wait(states, handled, silent)
        if state.refusal:
            raise RequestFailed(f"refused: {state.refusal}")
        return state

    def matched_publisher(self, topic: topics.Topic) -> Publisher:
        """Publisher with a subscriber: requests are not kept for one that comes later."""
        publisher = self.bus.publisher(topic)
        deadline = time.monotonic() + ANSWER_TIMEOUT
        while not publisher.has_subscribers:
            if time.monotonic() > deadline:
                raise RequestFailed(
                    f"no process subscribes to {topic.key}; `lariat status` shows which run"
                )
            time.sleep(POLL_PERIOD)
        return publisher
