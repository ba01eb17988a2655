"""Checklist on the page: it is published, and only an answer to the present question counts."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from lariat.scenario import find, load
from shared import topics
from shared.messages import ArmStates, CommissioningAnswer, CommissioningState
from stack.client import Client
from stack.commissioning import page_operator
from stack.commissioning.checklist import STEPS
from stack.commissioning.page_operator import PageOperator
from stack.commissioning.record import FAILED, PASSED, CommissioningRecord, Result, fingerprint
from stack.commissioning.session import NotPassed
from tests.shared.cell import Cell, until

SCENARIO = load(find("fixed-end"))


class Table:
    """An operator on the bus, and the page that it talks to."""

    def __init__(self, cell: Cell, path: Path) -> None:
        self.record = CommissioningRecord(path)
        self.lines: list[str] = []
        page = cell("dashboard")
        self._states = page.subscribe(topics.COMMISSIONING_STATE)
        self._answers = page.publisher(topics.COMMISSIONING_ANSWER)
        client = Client(cell("lariat"), "lariat-test")
        self.operator = PageOperator(client, SCENARIO, self.record, self.lines.append)
        until(lambda: self._answers.has_subscribers)
        self.state = CommissioningState()

    def seen(self) -> CommissioningState:
        for _, item in self._states.take():
            self.state = item.message
        return self.state

    def answer(self, question: str, yes: bool) -> None:
        self._answers.put(CommissioningAnswer(id="page-1", question_id=question, yes=yes))

    def ask(self, question: str) -> tuple[threading.Thread, list[bool]]:
        answers: list[bool] = []
        thread = threading.Thread(target=lambda: answers.append(self.operator.agree(question)))
        thread.start()
        until(lambda: self.seen().question == question)
        return thread, answers


@pytest.fixture
def cell() -> Iterator[Cell]:
    with ExitStack() as stack:
        yield Cell(stack)


@pytest.fixture
def table(cell: Cell, tmp_path: Path) -> Table:
    return Table(cell, tmp_path / "cell.commissioning.json")


def test_only_an_answer_to_the_present_question_counts(table: Table) -> None:
    thread, answers = table.ask("May it move?")
    first = table.state.question_id
    table.answer(first, False)
    thread.join(5.0)
    thread, more = table.ask("Really?")
    table.answer(first, True)
    table.answer("", True)
    thread.join(0.2)
    assert thread.is_alive()
    table.answer(table.state.question_id, True)
    thread.join(5.0)
    assert (answers, more) == ([False], [True])
    until(lambda: table.seen().question == "")


def test_a_question_that_nobody_answers_is_no_consent(
    table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_operator, "ANSWER_TIMEOUT", 0.05)
    with pytest.raises(NotPassed, match="nobody has answered on the page"):
        table.operator.agree("May it move?")


def test_the_page_sees_results_that_hold_and_the_step_that_goes_on(table: Table) -> None:
    step = STEPS[1]
    settings = fingerprint(SCENARIO, step.settings)
    table.record.put(step.name, Result(PASSED, "speed 0.05 m/s", "2026-01-01T09:00:00", settings))
    table.record.put(STEPS[0].name, Result(PASSED, "of old", "2026-01-01T09:00:00", "other"))
    table.operator.begin(3)
    table.operator.tell("3/13 Processes and versions …")
    until(lambda: table.seen().current == 3 and table.state.line)
    steps = table.state.steps
    assert [s.title for s in steps] == [s.title for s in STEPS]
    assert (steps[1].outcome, steps[1].detail) == ("passed", "speed 0.05 m/s")
    assert steps[0].outcome == ""
    table.operator.close()
    until(lambda: table.seen().ended)


def test_the_page_sees_the_failure_of_a_step_that_every_session_repeats(
    cell: Cell, tmp_path: Path
) -> None:
    step = STEPS[2]
    path, settings = tmp_path / "cell.commissioning.json", fingerprint(SCENARIO, step.settings)
    former = Result(PASSED, "version 0", "2026-01-01T09:00:00", settings)
    CommissioningRecord(path).put(step.name, former)
    table = Table(cell, path)
    table.operator.begin(3)
    until(lambda: table.seen().current == 3)
    assert table.state.steps[2].outcome == ""
    now = Result(FAILED, "planner is not heard", "2026-01-02T09:00:00", settings)
    table.record.put(step.name, now)
    table.operator.close()
    until(lambda: table.seen().ended)
    assert table.state.steps[2].detail == "planner is not heard"


class ArmsOnTheirWay:
    """Link that shows a series of states."""

    def __init__(self, *states: ArmStates) -> None:
        self._states = states

    def observe(self, until, seconds: float) -> list[ArmStates]:
        shown: list[ArmStates] = []
        for state in self._states:
            shown.append(state)
            if until(state):
                break
        return shown


STANDING = ArmStates(needs_approach=True)
GOING = ArmStates(may_move=True, approaching=True)
THERE = ArmStates(may_move=True)
LET_GO = ArmStates(needs_approach=True, reason="the approach was let go")
HELD = ArmStates(needs_acknowledgement=True, reason="held by a person")


@pytest.mark.parametrize(
    ("states", "ended"),
    [
        ((STANDING, GOING, GOING, THERE), ""),
        ((STANDING, GOING, LET_GO, GOING, THERE), ""),
        ((STANDING, GOING, LET_GO), "the approach was let go"),
        ((STANDING, GOING, HELD, THERE), "held by a person"),
        ((HELD, THERE), "held by a person"),
        ((STANDING, STANDING), "nobody has held the button"),
        ((), "nobody has held the button"),
    ],
)
def test_an_approach_ends_with_the_button_of_the_page(
    table: Table, states: tuple[ArmStates, ...], ended: str
) -> None:
    link = ArmsOnTheirWay(*states)
    assert table.operator.approach(link, STANDING) == ended  # pyright: ignore[reportArgumentType]
