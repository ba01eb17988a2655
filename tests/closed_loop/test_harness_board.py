"""A cable that keeps a bend is laid through three clips, past two pegs."""

from __future__ import annotations

import pytest

from tests.closed_loop.loop import run


@pytest.mark.slow
def test_all_clips_hold_the_cable_in_the_end():
    score = run("harness-board", "run.time_limit=14.0").score
    assert score.clips_held == ["low", "middle", "high"]
    assert score.reached
    assert score.max_tension_n is not None
    assert 0.0 < score.max_tension_n < 0.5
