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
from shared.messages import Health
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


def test_a_page_is_heard_a_while_after_joining(
    cell: Cell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(commission, "go_through", lambda *words: asked.append(words) or True)
    health = cell("dashboard").publisher(topics.HEALTH.at("dashboard"))
    over = threading.Event()

    def beat() -> None:
        while not over.wait(1.0):
            health.put(Health())

    heart = threading.Thread(target=beat)
    heart.start()
    try:
        results = str(tmp_path / "results.json")
        words = ["commission", "fixed-end", "--page", "--results", results]
        assert main([*words, *cell.arguments]) == 0
    finally:
        over.set()
        heart.join()
    assert len(asked) == 1
