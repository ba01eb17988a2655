"""Client: a request is answered in its owner's state, refused in words, or reported unanswered."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from cli import __main__ as lariat
from shared import topics
from shared.messages import TaskRequest
from stack import client as client_module
from stack.client import Client, RequestFailed
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live


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
    client = Client(cell("lariat"), "lariat-test")
    state = client.request_task(TaskRequest.START)
    assert state.last_request == "lariat-test-1"


def test_a_refusal_comes_in_words(cell: Cell, beacon: object) -> None:
    client = Client(cell("lariat"), "lariat-test")
    with pytest.raises(RequestFailed, match=r"^refused: as asked$"):
        client.request_task(TaskRequest.SET, key="refuse")


def test_a_missing_controller_is_reported(
    cell: Cell, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(client_module, "ANSWER_TIMEOUT", 0.3)
    recorder = cell("recorder").subscribe_all()
    assert lariat.main(["pause", *cell.arguments]) == 1
    said = capfd.readouterr().err
    assert "controller" in said
    assert "`lariat status`" in said
    assert not [r for r in recorder.take() if r.key == "task/request"]
