"""Scenarios that are run, reset and run again in one stack."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.scenario.settings import load_with
from lariat.scenario.shipped import shipped_names
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import REACHED, chain
from tests.closed_loop.repeated_runs import RepeatedRuns

NAMES = [
    pytest.param(name, marks=() if name == "two-arms" else pytest.mark.slow)
    for name in shipped_names()
]


def settled_rope(cell: RepeatedRuns) -> np.ndarray:
    """Nodes of the true rope after a second, in which it may sway a little [m]."""
    cell.stack.advance_to(cell.stack.now + SECOND)
    truth = cell.stack.latest(topics.ROPE_TRUTH)
    assert truth is not None
    return chain(truth.positions)


@pytest.mark.parametrize("name", NAMES)
def test_goal_is_reached_again_after_a_reset_and_the_rope_hangs_as_at_first(name: str) -> None:
    cell = RepeatedRuns(load_with(Path(name), ("sensing.source=truth",)))
    start = settled_rope(cell)
    for _ in range(2):
        task = cell.run()
        assert task.state == REACHED, task.reason
        cell.reset()
        assert np.max(np.linalg.norm(settled_rope(cell) - start, axis=1)) < 2e-3
