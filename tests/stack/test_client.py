"""A verb and the answer of the service that owns the state."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from cli import __main__ as lariat
from shared import topics
from shared.messages import TaskRequest
from stack import client
from stack.client import Conversation, Unanswered
from tests.shared.cell import Cell, until


@pytest.fixture
def cell() -> Iterator[Cell]:
    with ExitStack() as stack:
        yield Cell(stack)


@pytest.fixture
def beacon(cell: Cell) -> Iterator[subprocess.Popen[bytes]]:
    """A process that answers requests in its state."""
    process = subprocess.Popen([sys.executable, "-m", "tests.shared.beacon", *cell.arguments])
    states = cell("ear").subscribe(topics.HEALTH)
    until(states.take, 30.0)
    yield process
    process.kill()
    process.wait()


def test_the_owner_of_the_state_answers(cell: Cell, beacon: object) -> None:
    talk = Conversation(cell("lariat"), "lariat-test")
    state = talk.task(TaskRequest.START)
    assert state.last_request == "lariat-test-1"


def test_a_refusal_comes_in_words(cell: Cell, beacon: object) -> None:
    talk = Conversation(cell("lariat"), "lariat-test")
    with pytest.raises(Unanswered, match=r"^refused: as asked$"):
        talk.task(TaskRequest.SET, key="refuse")


def test_a_controller_that_is_not_there_is_said(
    cell: Cell, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(client, "PATIENCE", 0.3)
    recorder = cell("recorder").subscribe_all()
    assert lariat.main(["start", *cell.arguments]) == 1
    assert "the controller says nothing; `lariat status` shows who runs" in capfd.readouterr().err
    assert not [r for r in recorder.take() if r.key == "task/request"]
