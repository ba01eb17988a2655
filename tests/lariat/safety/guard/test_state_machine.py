from __future__ import annotations

import pytest

from lariat.safety.guard.operator_commands import CommandRejected
from lariat.safety.guard.state_machine import SafetyState
from lariat.safety.guard.stop_causes import STOP_CAUSES

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


def test_armed_cell_is_not_armed_again() -> None:
    with pytest.raises(CommandRejected, match="armed already"):
        MOVING.armed()


@pytest.mark.parametrize("cause", ["person", "alarm"])
def test_stopped_cell_is_not_armed_but_disarmed_or_acknowledged(cause: str) -> None:
    stopped = MOVING.stopped(cause, "for a test")
    with pytest.raises(CommandRejected, match="acknowledge"):
        stopped.armed()
    assert stopped.disarmed().mode == "disarmed"
    assert stopped.acknowledged().mode == "holding"


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


@pytest.mark.parametrize("cause", ["person", "alarm", "silence"])
def test_acknowledged_cell_stands_until_it_is_resumed(cause: str) -> None:
    stopped = MOVING.stopped(cause, "for a test")
    with pytest.raises(CommandRejected, match="acknowledge first"):
        stopped.resumed()
    standing = stopped.acknowledged()
    assert standing.needs_resume
    assert not standing.needs_acknowledgement
    assert not standing.may_move
    assert standing.moving(True) == standing
    assert standing.resumed().may_move
    with pytest.raises(CommandRejected, match="nothing to resume"):
        standing.resumed().resumed()


def test_acknowledged_cell_is_stopped_again_only_by_what_needs_a_person() -> None:
    standing = MOVING.stopped("person", "held").acknowledged()
    assert standing.stopped("writer_holds", "paused") == standing
    assert standing.stopped("person", "held again").needs_acknowledgement
    assert standing.stopped("alarm", "alarm 117").mode == "fault"


def test_approach_that_was_let_go_goes_on_by_another_approach_alone() -> None:
    stopped = DISARMED.approaching().stopped("consent", "let go")
    assert stopped.needs_approach
    assert not stopped.may_move
    for transition in (stopped.acknowledged, stopped.resumed, stopped.armed):
        with pytest.raises(CommandRejected):
            transition()
    assert stopped.approaching().may_move
    with pytest.raises(CommandRejected, match="while disarmed"):
        MOVING.approaching()


def test_arming_forgets_the_writer() -> None:
    assert MOVING.disarmed().armed().session == ""


@pytest.mark.parametrize(
    "cause", ["person", "tracking", "lost_link", "left_behind", "writer_holds"]
)
def test_only_another_approach_goes_on_after_a_stop_of_an_approach(cause: str) -> None:
    held = DISARMED.approaching().moving(True).stopped(cause, "for a test")
    assert not held.may_move
    if held.needs_acknowledgement:
        held = held.acknowledged()
    assert held.needs_approach
    for refused in (held.acknowledged, held.resumed, held.armed):
        with pytest.raises(CommandRejected):
            refused()
    arrived = held.approaching().moving(True).moving(False)
    assert arrived.may_move
    assert arrived.stopped("person", "held").acknowledged().needs_resume
