"""Client side of an approach, against a gateway that the test plays."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import pytest

from shared import topics
from shared.messages import ArmCommand, ArmState, ArmStates, Consent
from stack.approach import approach
from stack.client import Client, RequestFailed
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live


class Gateway:
    """Publishes a state at every look, and keeps what it hears."""

    def __init__(self, cell: Cell) -> None:
        bus = cell("gateway")
        self._states = bus.publisher(topics.ARM_STATE)
        self._commands = bus.subscribe(topics.ARM_COMMAND)
        self._consents = bus.subscribe(topics.ARM_CONSENT)
        arms = [ArmState(arm="left"), ArmState(arm="right")]
        self.state = ArmStates(
            boot="boot-1",
            next_session="a",
            approach_distance=0.3339,
            approach_angle=1.57,
            arms=arms,
        )
        self.commands: list[ArmCommand] = []
        self.consents: list[Consent] = []

    def look(self) -> None:
        self.state.stamp = time.monotonic_ns()
        self._states.put(self.state)
        self.commands += [item.message for _, item in self._commands.take()]
        self.consents += [item.message for _, item in self._consents.take()]
        time.sleep(0.002)

    def until_commanded(self) -> ArmCommand:
        until(lambda: self.look() or self.commands)
        return self.commands[0]


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def test_consent_is_published_while_the_button_is_held_and_no_longer(stack: ExitStack) -> None:
    cell = Cell(stack)
    gateway, client = Gateway(cell), Client(cell("person"), "person")
    button = [True]
    pool = stack.enter_context(ThreadPoolExecutor(1))
    ended = pool.submit(approach, client, gateway.state, 0.334, lambda: button[0])

    command = gateway.until_commanded()
    assert (command.action, command.boot, command.session) == (ArmCommand.APPROACH, "boot-1", "a")
    assert (command.approach_distance, command.approach_angle) == (0.334, 1.57)
    gateway.state.last_command, gateway.state.approaching = command.id, True
    until(lambda: gateway.look() or len(gateway.consents) >= 10)
    numbers = [consent.sequence for consent in gateway.consents]
    assert numbers == sorted(set(numbers))
    assert {(c.command, c.boot) for c in gateway.consents} == {(command.id, "boot-1")}
    # Signs of life echo the newest state.
    assert len({c.answers for c in gateway.consents}) > 5

    button[0] = False
    for _ in range(20):
        gateway.look()
    heard = len(gateway.consents)
    for _ in range(30):
        gateway.look()
    assert len(gateway.consents) == heard
    gateway.state.approaching, gateway.state.reason = False, "let go"
    until(lambda: gateway.look() or ended.done())
    assert ended.result() == "let go"


def test_refused_approach_publishes_the_refusal(stack: ExitStack) -> None:
    cell = Cell(stack)
    gateway, client = Gateway(cell), Client(cell("person"), "person")
    pool = stack.enter_context(ThreadPoolExecutor(1))
    ended = pool.submit(approach, client, gateway.state, 0.1, lambda: True)
    gateway.state.last_command = gateway.until_commanded().id
    gateway.state.refusal = "look again"
    until(lambda: gateway.look() or ended.done())
    with pytest.raises(RequestFailed, match="look again"):
        ended.result()
