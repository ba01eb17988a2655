"""`lariat commission`: where a person is asked."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from cli import commission
from cli.__main__ import main
from shared import topics
from shared.messages import ArmState, ArmStates, Health
from tests.shared.cell import Cell


@pytest.fixture
def cell() -> Iterator[Cell]:
    with ExitStack() as stack:
        yield Cell(stack)


def test_a_page_that_nobody_serves_is_not_waited_for(
    cell: Cell, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["commission", "fixed-end", "--page", *cell.arguments]) == 1
    assert "the stack runs without its dashboard" in capsys.readouterr().err


@pytest.fixture
def stack(cell: Cell) -> Iterator[Cell]:
    """Cell whose dashboard is alive, and whose right arm has power."""
    bus, over = cell("dashboard"), threading.Event()
    health = bus.publisher(topics.HEALTH.at("dashboard"))
    states = bus.publisher(topics.ARM_STATE)
    arms = [ArmState(arm="left"), ArmState(arm="right", powered=True)]

    def beat() -> None:
        while not over.wait(0.5):
            health.put(Health())
            states.put(ArmStates(arms=arms))

    heart = threading.Thread(target=beat)
    heart.start()
    yield cell
    over.set()
    heart.join()


def test_a_page_is_heard_a_while_after_joining(
    stack: Cell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(commission, "go_through", lambda *words: asked.append(words) or True)
    results = str(tmp_path / "results.json")
    words = ["commission", "fixed-end", "--page", "--results", results]
    assert main([*words, *stack.arguments]) == 0
    assert len(asked) == 1


def test_a_checklist_without_its_end_names_the_arms_that_keep_their_power(
    stack: Cell,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def interrupted(*words: object) -> bool:
        raise KeyboardInterrupt

    monkeypatch.setattr(commission, "go_through", interrupted)
    results = str(tmp_path / "results.json")
    words = ["commission", "fixed-end", "--page", "--results", results]
    assert main([*words, *stack.arguments]) == 1
    said = capsys.readouterr().out
    assert "still powered: right; `lariat disarm` takes the power" in said
    assert f"results: {results}" in said
