"""A rope that is known in part keeps the clearance that is asked for, or stands still."""

from __future__ import annotations

import numpy as np

from shared import topics
from tests.closed_loop.loop import run

UNKNOWN = (
    "control.adapt=true",
    "plant.rope.youngs_modulus=2e6",
    "sensing.source=truth",
    "sensing.node_noise=0.001",
)


def test_path_that_may_come_too_near_is_replaced_by_a_slower_one_with_more_room() -> None:
    free = run("three-cylinders", *UNKNOWN, "control.certain_clearance=-0.2")
    careful = run("three-cylinders", *UNKNOWN, "control.certain_clearance=0.009")
    for outcome in (free, careful):
        assert outcome.score.reached, outcome.reason
    assert measured(free.score.certain_clearance_mm) < 9.0
    assert measured(careful.score.certain_clearance_mm) >= 9.0
    assert measured(careful.score.min_clearance_mm) >= 9.0
    assert measured(careful.score.reached_s) > measured(free.score.reached_s)
    task = careful.stack.latest(topics.TASK_STATE)
    assert task is not None
    assert task.pace < 1.0


def test_nothing_is_said_to_be_certain_where_nobody_asks() -> None:
    outcome = run("three-cylinders", *UNKNOWN, "run.time_limit=0.5")
    assert outcome.score.min_clearance_mm is not None
    assert outcome.score.certain_clearance_mm is None


def test_arms_stand_where_no_path_keeps_it() -> None:
    outcome = run("three-cylinders", *UNKNOWN, "control.certain_clearance=0.1")
    assert not outcome.score.reached
    assert "control.certain_clearance = 100 mm" in outcome.reason
    moved = np.linalg.norm(outcome.scorer.ropes[-1] - outcome.scorer.ropes[0], axis=1)
    assert np.max(moved) < 1e-3


def measured(value: float | None) -> float:
    assert value is not None
    return value
