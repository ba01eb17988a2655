"""A cable that keeps a bend is laid through three clips, past two pegs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lariat.scenario import Scenario, load, parse
from stack.simulation import closed_loop

BOARD = load("harness-board")
GUIDE = (Path(__file__).parents[2] / "docs" / "guide" / "scenes.md").read_text()


def with_arms() -> Scenario:
    """The board with the arms that the guide puts in the place of its ends."""
    (arms,) = re.findall(r"```toml\n(\[ends\.left\]\ndriver = \"cr5\".*?)```", GUIDE, re.DOTALL)
    ends = "[ends.left]\nrotates = true\n\n[ends.right]\nrotates = true\n"
    assert BOARD.text.count(ends) == 1
    return parse(BOARD.text.replace(ends, arms), BOARD.folder)


@pytest.mark.slow
@pytest.mark.parametrize("board", [BOARD, with_arms()], ids=["ideal", "cr5"])
def test_all_clips_hold_the_cable_in_the_end(board: Scenario):
    score = closed_loop.run(board, stop_after=0.5).score
    assert score.clips_held == ["low", "middle", "high"]
    assert score.reached
    assert 0.0 < score.max_tension_n < 0.5
