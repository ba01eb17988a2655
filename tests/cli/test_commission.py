"""`lariat commission`: where a person is asked."""

from __future__ import annotations

from contextlib import ExitStack

import pytest

from cli.__main__ import main
from tests.shared.cell import Cell


def test_a_page_that_nobody_serves_is_not_waited_for(capsys: pytest.CaptureFixture[str]) -> None:
    with ExitStack() as stack:
        cell = Cell(stack)
        assert main(["commission", "fixed-end", "--page", *cell.arguments]) == 1
    assert "the stack runs without its dashboard" in capsys.readouterr().err
