from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from dashboard.panels.run_plots import RunPlots, over_earlier_runs, result_text
from dashboard.web.private_viser import PrivateViser
from lariat.scenario import load
from lariat.trajectory import SECOND
from shared.messages import REACHED, RUNNING, RunResult, TaskState


@pytest.mark.parametrize(
    ("result", "text"),
    [
        (RunResult(run="a", reached=True), "Run a: reached"),
        (RunResult(run="a", reason="stopped"), "Run a: stopped"),
        (RunResult(run="a"), "Run a: not reached yet"),
        (RunResult(run="a", replans=1), "1 replan"),
        (RunResult(run="a", replans=2), "2 replans"),
        (RunResult(run="a", error=0.00123, max_node_error=0.004), "1.23 mm, largest 4.00 mm"),
    ],
)
def test_result_names_verdict_errors_and_replans(result: RunResult, text: str) -> None:
    assert text in result_text(result)


def state(run: int, seconds: float, error: float, kind: int = RUNNING) -> TaskState:
    started = 100 * run * SECOND
    stamp = started + round(seconds * SECOND)
    return TaskState(
        stamp=stamp, run=f"run-{run}", run_started=started, state=kind, error=error, clearance=0.02
    )


@pytest.fixture
def plots() -> Iterator[RunPlots]:
    private = PrivateViser("test")
    yield RunPlots(private.server.gui, load("scenarios/three-cylinders.toml"))
    private.close()


def test_run_that_ends_at_once_leaves_a_curve(plots: RunPlots) -> None:
    plots.add(state(1, 0.0, 0.002))
    plots.add(state(1, 0.3, 0.001, REACHED))
    plots.add(state(1, 5.0, 0.0005, REACHED))
    plots.draw(1.0)
    times, _, error, *_ = plots.error_chart.data
    np.testing.assert_allclose(times, [0.0, 0.3])
    np.testing.assert_allclose(error, [2.0, 1.0])


def test_next_run_is_drawn_over_the_one_before(plots: RunPlots) -> None:
    for run, errors in ((1, (0.1, 0.05, 0.01)), (2, (0.2, 0.1))):
        for k, error in enumerate(errors):
            plots.add(state(run, float(k), error))
    plots.draw(1.0)
    times, _, present, before, *older = plots.error_chart.data
    np.testing.assert_allclose(times, [0.0, 1.0, 2.0])
    np.testing.assert_allclose(present, [200.0, 100.0, np.nan])
    np.testing.assert_allclose(before, [100.0, 50.0, 10.0])
    assert all(np.array_equal(row, present, equal_nan=True) for row in older)


def test_curves_begin_with_a_number_and_end_with_their_last_one() -> None:
    a = np.array([0.0, 2.0]), np.array([0.0, 4.0])
    b = np.array([1.0]), np.array([7.0])
    times, limit, first, second, *_ = over_earlier_runs([a, b], 5.0)
    np.testing.assert_allclose(times, [0.0, 1.0, 2.0])
    np.testing.assert_allclose(first, [0.0, 2.0, 4.0])
    np.testing.assert_allclose(second, [7.0, 7.0, np.nan])
    np.testing.assert_allclose(limit, 5.0)


def test_chart_without_a_run_spans_the_limit() -> None:
    empty = np.zeros(0), np.zeros(0)
    times, limit, *rows = over_earlier_runs([empty], 5.0)
    assert len(times) == len(limit) == 2
    assert all(row[0] == 0.0 and np.isnan(row[1]) for row in rows)
