from __future__ import annotations

import pytest

from services.robot_gateway.safety.state_machine import (
    Action,
    CommandRejected,
    OperatorCommand,
    SafetyState,
)
from services.robot_gateway.safety.stop_causes import STOP_CAUSES
from shared.service import SECOND

DISARMED = SafetyState("boot-1")
ARMED = DISARMED.armed()
MOVING = ARMED.with_writer("writer").moving(True)


def test_cell_boots_disarmed_and_may_not_move() -> None:
    assert (DISARMED.mode, DISARMED.cause) == ("disarmed", "boot")
    assert not DISARMED.may_move


def test_armed_cell_moves_and_comes_to_rest_armed() -> None:
    assert ARMED.may_move
    assert MOVING.mode == "moving"
    assert MOVING.moving(False).mode == "armed"


def test_arming_is_rejected_for_a_reason() -> None:
    with pytest.raises(CommandRejected, match="right: collision"):
        DISARMED.armed("right: collision")


def test_armed_cell_is_not_armed_again() -> None:
    with pytest.raises(CommandRejected, match="armed already"):
        MOVING.armed()


@pytest.mark.parametrize("cause", ["person", "alarm"])
def test_stopped_cell_is_not_armed_but_disarmed_or_acknowledged(cause: str) -> None:
    stopped = MOVING.stopped(cause, "for a test")
    with pytest.raises(CommandRejected, match="disarm or acknowledge first"):
        stopped.armed()
    assert stopped.disarmed().mode == "disarmed"
    assert stopped.acknowledged().mode == "armed"


def test_nothing_but_arming_leaves_disarmed() -> None:
    assert DISARMED.with_writer("writer") == DISARMED
    assert DISARMED.moving(True) == DISARMED
    assert DISARMED.stopped("alarm", "late") == DISARMED
    with pytest.raises(CommandRejected):
        DISARMED.acknowledged()
    assert DISARMED.armed().mode == "armed"


def test_weaker_cause_never_replaces_a_stronger_one() -> None:
    fault = MOVING.stopped("alarm", "alarm 117")
    for cause in ("silence", "writer_holds", "person"):
        assert fault.stopped(cause, "later") == fault
    held = MOVING.stopped("person", "held")
    assert held.stopped("writer_holds", "paused") == held
    assert held.stopped("lost_link", "gone").mode == "fault"


def test_hold_of_the_writer_goes_on_by_itself() -> None:
    held = MOVING.stopped("writer_holds", "paused")
    assert held.may_move
    assert not held.needs_acknowledgement
    assert held.moving(True).mode == "moving"
    with pytest.raises(CommandRejected, match="nothing to acknowledge"):
        held.acknowledged()


@pytest.mark.parametrize("cause", [c for c in STOP_CAUSES if STOP_CAUSES[c].resumes == "by itself"])
def test_cause_that_resumes_by_itself_needs_no_person(cause: str) -> None:
    assert not MOVING.stopped(cause, "for a test").needs_acknowledgement


def test_second_writer_holds_the_cell_until_it_is_acknowledged() -> None:
    held = MOVING.with_writer("second")
    assert (held.cause, held.session, held.waiting_session) == ("new_writer", "writer", "second")
    assert held.needs_acknowledgement
    acknowledged = held.acknowledged()
    assert (acknowledged.session, acknowledged.waiting_session) == ("second", "")


def test_arming_forgets_the_writer() -> None:
    assert MOVING.disarmed().armed().session == ""


@pytest.mark.parametrize(
    ("boot", "answers", "words"),
    [
        ("boot-1", SECOND, ""),
        ("boot-1", SECOND - 1, "1.000 s old"),
        ("boot-1", 2 * SECOND + 1, "old"),
        ("boot-0", 2 * SECOND, "check the state"),
    ],
    ids=["boundary", "late", "of a state to come", "of another start"],
)
def test_command_counts_for_this_start_and_as_answer_to_a_recent_state(
    boot: str, answers: int, words: str
) -> None:
    command = OperatorCommand("id", boot, answers, "acknowledge")
    if not words:
        DISARMED.check(command, 2 * SECOND)
        return
    with pytest.raises(CommandRejected, match=words):
        DISARMED.check(command, 2 * SECOND)


@pytest.mark.parametrize("action", ["hold", "disarm"])
def test_stop_is_obeyed_whatever_boot_and_expiry_it_carries(action: Action) -> None:
    ARMED.check(OperatorCommand("id", "boot-of-yesterday", -1, action), 100)
