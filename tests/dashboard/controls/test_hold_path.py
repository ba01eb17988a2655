from __future__ import annotations

from dashboard.controls.hold_path import HoldPath
from dashboard.web.cell_socket import HoldAnswer
from shared.messages import ArmCommand, ArmStates

MOVING = ArmStates(boot="boot-7", stamp=5, mode=ArmStates.MOVING, may_move=True)


class Gateway:
    """Hold path, and what it has sent."""

    def __init__(self) -> None:
        self.path = HoldPath("dashboard-ab")
        self.sent: list[ArmCommand] = []
        self.path.connect(self.sent.append)


def test_hold_is_sent_at_once_even_before_the_first_state_of_the_gateway() -> None:
    gateway = Gateway()
    gateway.path.hold()
    assert [command.action for command in gateway.sent] == [ArmCommand.HOLD]


def test_hold_before_the_bus_is_joined_is_sent_once_it_is() -> None:
    path = HoldPath("dashboard-ab")
    answer = path.hold()
    sent: list[ArmCommand] = []
    path.connect(sent.append)
    (command,) = sent
    path.take(ArmStates(mode=ArmStates.HOLDING, last_command=command.id))
    assert answer.result(0.0).confirmed


def test_hold_that_is_sent_before_the_gateway_is_heard_is_sent_once_more() -> None:
    gateway = Gateway()
    gateway.path.hold()
    for _ in range(2):
        gateway.path.take(MOVING)
    assert [command.id for command in gateway.sent] == 2 * [gateway.sent[0].id]


def test_hold_is_confirmed_by_the_gateways_answer_only() -> None:
    gateway = Gateway()
    gateway.path.take(MOVING)
    gateway.path.newest = MOVING
    answer = gateway.path.hold()
    (command,) = gateway.sent
    assert (command.boot, command.answers) == ("boot-7", 5)
    gateway.path.take(MOVING)
    # This hold ends by itself, so it confirms nothing.
    gateway.path.take(ArmStates(mode=ArmStates.HOLDING, may_move=True))
    assert not answer.done()
    assert gateway.path.waits
    gateway.path.take(ArmStates(mode=ArmStates.HOLDING, last_command=command.id))
    assert answer.result(0.0).confirmed
    assert not gateway.path.waits


def test_every_hold_has_an_answer_of_its_own() -> None:
    gateway = Gateway()
    answers = [gateway.path.hold() for _ in range(3)]
    assert len({command.id for command in gateway.sent}) == 3
    gateway.path.take(ArmStates(mode=ArmStates.HOLDING))
    assert all(answer.result(0.0).confirmed for answer in answers)


def test_refused_hold_is_not_confirmed() -> None:
    gateway = Gateway()
    answer = gateway.path.hold()
    gateway.path.take(
        ArmStates(mode=ArmStates.MOVING, last_command=gateway.sent[0].id, refusal="no")
    )
    assert answer.result(0.0) == HoldAnswer(False, "no")
