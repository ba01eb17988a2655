"""Paths are requested a few times for each cause, with growing care."""

from __future__ import annotations

import pytest

from lariat.control.supervision.replanning import MAX_REPLANS, Cause
from tests.lariat.control.supervision.started_run import Run


def test_clearance_grows_with_the_measured_error_of_the_predictions(run: Run) -> None:
    assert run.replanning.request_careful(Cause.UNFOLLOWED, 0.007)
    assert run.task.clearance_margin == pytest.approx(2.0 * (0.007 - 0.002))
    assert run.replanning.request_careful(Cause.CONTACT, 0.1)
    assert run.task.clearance_margin == 0.02


def test_each_cause_has_a_budget_of_its_own_which_a_run_restores(run: Run) -> None:
    replanning, asked = run.replanning, run.task.replan_count
    for _ in range(2):
        for cause, most in MAX_REPLANS.items():
            requested = [replanning.request(cause) for _ in range(most + 1)]
            assert requested == [True] * most + [False]
        replanning.begin_run()
    assert set(MAX_REPLANS) == set(Cause)
    assert run.task.replan_count == asked + 2 * sum(MAX_REPLANS.values())
