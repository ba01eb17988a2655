"""A rope that hangs on something ends the run; one that stays behind once is led again."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunState
from lariat.control.supervision.rope_watch import RopeWatch
from lariat.control.supervision.snag_detector import Snag
from lariat.trajectory import SECOND
from tests.lariat.control.supervision.started_run import Run


def watch_of(run: Run) -> RopeWatch:
    rope: Any = SimpleNamespace(predictions=SimpleNamespace(max_deviation=0.004))
    return RopeWatch(run.task, rope, run.progress, run.replanning)


def test_snag_ends_the_run_and_says_where(run: Run) -> None:
    watch_of(run).snagged(Snag("taut", np.array([0.02, 0.0, 0.31])))
    assert run.task.reason.code is ReasonCode.SNAG_TAUT
    assert "[0.02, 0.00, 0.31] m" in str(run.task.reason)


def test_rope_that_stays_behind_once_gets_another_path_and_a_slower_pace(run: Run) -> None:
    snag, before = Snag("stays_behind", np.array([0.02, 0.0, 0.31])), run.task.replan_count
    watch_of(run).snagged(snag)
    assert (run.task.state, run.task.replan_count) == (RunState.RUNNING, before + 1)
    assert run.task.pace < 1.0
    watch_of(run).snagged(snag)
    assert run.task.reason.code is ReasonCode.SNAG_STAYS_BEHIND


def test_slip_is_judged_only_beside_grips_that_have_spoken_since_the_image(run: Run) -> None:
    nodes = np.linspace((-0.2, 0.0, 0.3), (0.2, 0.0, 0.3), 10)
    states: Any = SimpleNamespace(
        time=SECOND, model_nodes_at=lambda _: nodes + 0.04, offset=np.zeros((10, 3))
    )
    rope: Any = SimpleNamespace(estimator=states)
    watch = RopeWatch(run.task, rope, run.progress, run.replanning)
    for stamp, slips in ((1.2, False), (1.05, True)):
        seen = RopeObservation(int(stamp * SECOND), nodes, np.zeros(10), np.ones(10, dtype=bool))
        for _ in range(4):
            watch.observe(seen, seen, (), following=False)
        assert (run.task.state is not RunState.RUNNING) is slips
    assert run.task.reason.code is ReasonCode.SLIPPED
