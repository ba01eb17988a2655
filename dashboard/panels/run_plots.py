"""Plots of a run: mean node error and clearance over time, and its result."""

from __future__ import annotations

import math

import numpy as np
import viser

from dashboard import palette
from dashboard.panels.chart import REFRESH_PERIOD, add_chart
from dashboard.panels.history import History
from dashboard.panels.note import note_html
from shared.messages import PAUSED, RUNNING, RunResult, TaskState
from shared.scenario import Scenario
from shared.service import SECOND

EMPTY_CHART_SPAN = 10.0
"""Time that a chart spans before there is anything to draw [s]."""


class RunPlots:
    """Charts of error and clearance since the start of the run, with tolerance and limit."""

    def __init__(self, gui: viser.GuiApi, scenario: Scenario) -> None:
        self._limits_mm = (1e3 * scenario.run.tolerance, 1e3 * scenario.control.clearance)
        self._history = History(2)
        self._run = ""
        self._run_started = 0
        self._draw_time = -math.inf
        self._stale = True
        self._error = add_chart(
            gui,
            "Mean node distance to the goal [mm]",
            "error",
            palette.BUSY,
            limit_label="tolerance",
        )
        self._clearance = add_chart(
            gui, "Rope clearance [mm]", "clearance", palette.GOAL, limit_label="desired"
        )
        self._result = gui.add_html("")

    def clear(self) -> None:
        """Drop the history, for a new run or a jump in a recording."""
        self._history.clear()
        self._stale = True
        self._draw_time = -math.inf

    def add(self, task: TaskState) -> None:
        """Add error and clearance of a running or paused task."""
        if (task.run, task.run_started) != (self._run, self._run_started):
            self._run, self._run_started = task.run, task.run_started
            self.clear()
        if task.run_started and task.state in (RUNNING, PAUSED):
            seconds = (task.stamp - task.run_started) / SECOND
            clearance = task.clearance if math.isfinite(task.clearance) else math.nan
            self._stale |= self._history.add(seconds, 1e3 * task.error, 1e3 * clearance)

    def show_result(self, message: RunResult) -> None:
        """Show the result of a run."""
        self._result.content = note_html(result_text(message))

    def draw(self, now: float) -> None:
        """Draw the charts if they have changed, at most every `REFRESH_PERIOD`.

        Args:
            now: Present time [s].
        """
        if not self._stale or now - self._draw_time < REFRESH_PERIOD:
            return
        self._draw_time, self._stale = now, False
        time, error, clearance = self._history.columns
        for chart, values, limit in zip(
            (self._error, self._clearance), (error, clearance), self._limits_mm, strict=True
        ):
            chart.data = (
                (time, values, np.full(len(time), limit)) if len(time) else _empty_chart(limit)
            )


def _empty_chart(limit: float) -> tuple[np.ndarray, ...]:
    """Axes and limit line of a chart without values."""
    return np.array([0.0, EMPTY_CHART_SPAN]), np.array([0.0, np.nan]), np.full(2, limit)


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
