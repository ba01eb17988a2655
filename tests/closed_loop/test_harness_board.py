"""A cable that keeps a bend is laid through three clips, past two pegs."""

from __future__ import annotations

import pytest

from lariat.scenario import Scenario, load
from stack.simulation import closed_loop
from tests.robots import board_with_arms


@pytest.mark.slow
@pytest.mark.parametrize("board", [load("harness-board"), board_with_arms()], ids=["ideal", "cr5"])
def test_all_clips_hold_the_cable_in_the_end(board: Scenario):
    score = closed_loop.run(board, stop_after=0.5).score
    assert score.clips_held == ["low", "middle", "high"]
    assert score.reached
    assert score.max_tension_n is not None
    assert 0.0 < score.max_tension_n < 0.5
