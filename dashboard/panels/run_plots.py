"""Plots of the runs: mean node error and clearance over time, and the result of the last one."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
import viser

from dashboard import palette
from dashboard.markup import note_html
from dashboard.panels.chart import EARLIER_RUNS, REFRESH_PERIOD, Curve, add_chart, overlay
from dashboard.panels.cost_table import cost_html
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared.history import History
from shared.messages import FAILED, PAUSED, REACHED, RUNNING, Plan, RunResult, TaskState

COST_PERIOD = 0.5
"""Time between two updates of the cost by term [s]."""


class RunPlots:
    """Charts of error and clearance since the start of the run, over those of earlier runs."""

    def __init__(self, gui: viser.GuiApi, scenario: Scenario) -> None:
        self._limits_mm = (1e3 * scenario.run.tolerance, 1e3 * scenario.control.clearance)
        self._history = History(2)
        self._earlier: deque[History] = deque(maxlen=EARLIER_RUNS)
        self._run = ""
        self._run_started = 0
        self._over = True
        """Whether the end of the run has been drawn."""
        self._draw_time = -math.inf
        self._stale = True
        self.error_chart = add_chart(
            gui,
            "Mean node distance to the goal [mm]",
            "error",
            palette.BUSY,
            limit_label="tolerance",
            with_earlier_runs=True,
        )
        self.clearance_chart = add_chart(
            gui,
            "Rope clearance [mm]",
            "clearance",
            palette.GOAL,
            limit_label="desired",
            with_earlier_runs=True,
        )
        self._result = gui.add_html("")
        self._cost = gui.add_html("")
        self._cost_time = -math.inf

    def clear(self) -> None:
        """Drop all runs, for a jump in a recording."""
        self._history.clear()
        self._earlier.clear()
        self._run, self._run_started, self._over = "", 0, True
        self._stale = True
        self._draw_time = self._cost_time = -math.inf
        self._result.content = self._cost.content = ""

    def add(self, task: TaskState) -> None:
        """Add error and clearance of a task that runs or pauses, and those at its end."""
        if (task.run, task.run_started) != (self._run, self._run_started):
            self._run, self._run_started, self._over = task.run, task.run_started, False
            if len(self._history):
                self._earlier.append(self._history)
                self._history = History(2)
            self._stale = True
        runs = task.state in (RUNNING, PAUSED)
        if not task.run_started or (self._over and not runs):
            return
        self._over = not runs
        if runs or task.state in (REACHED, FAILED):
            seconds = (task.stamp - task.run_started) / SECOND
            clearance = task.clearance if math.isfinite(task.clearance) else math.nan
            self._stale |= self._history.add(seconds, 1e3 * task.error, 1e3 * clearance)

    def show_result(self, message: RunResult) -> None:
        """Show the result of a run."""
        self._result.content = note_html(result_text(message))

    def show_cost(self, plan: Plan, now: float) -> None:
        """Show the cost of the present horizon, at most every `COST_PERIOD`."""
        if 0.0 <= now - self._cost_time < COST_PERIOD:
            return
        self._cost_time = now
        self._cost.content = cost_html(plan.cost)

    def draw(self, now: float) -> None:
        """Draw the charts if they have changed, at most every `REFRESH_PERIOD`."""
        if not self._stale or now - self._draw_time < REFRESH_PERIOD:
            return
        self._draw_time, self._stale = now, False
        runs = [h.columns for h in (self._history, *reversed(self._earlier))]
        for column, (chart, limit) in enumerate(
            zip((self.error_chart, self.clearance_chart), self._limits_mm, strict=True), start=1
        ):
            shown = any(np.any(np.isfinite(run[column])) for run in runs)
            if shown:
                chart.data = over_earlier_runs([(run[0], run[column]) for run in runs], limit)
            chart.visible = shown


def over_earlier_runs(curves: Sequence[Curve], limit: float) -> tuple[np.ndarray, ...]:
    """Times of all curves, limit, and values of the present run and `EARLIER_RUNS` earlier ones.

    Where there are fewer, the present one stands in their place.
    """
    times, *rows = overlay(curves)
    rows += rows[:1] * (1 + EARLIER_RUNS - len(rows))
    return times, np.full(len(times), limit), *rows


def result_text(message: RunResult) -> str:
    """Result of a run, ended or not, in one sentence."""
    verdict = "reached" if message.reached else (message.reason or "not reached yet")
    return (
        f"Run {message.run}: {verdict}, {message.duration:.1f} s, "
        f"mean node error {1e3 * message.error:.2f} mm, "
        f"largest {1e3 * message.max_node_error:.2f} mm, "
        f"least clearance {1e3 * message.min_clearance:.1f} mm, "
        f"{message.replans} replan{'' if message.replans == 1 else 's'}"
    )
