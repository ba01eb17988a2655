"""Error and clearance of the run over time, and the adapted parameters."""

from __future__ import annotations

import html
import math

import numpy as np
import viser
from viser import uplot

from dashboard import palette
from dashboard.palette import Color
from dashboard.panels.history import History
from shared.messages import PAUSED, RUNNING, Parameters, RunResult, TaskState
from shared.scenario import Scenario
from shared.service import SECOND

REFRESH = 0.2
"""Least time between two drawings [s]."""
INK = "#aab4c3"
FONT = "11px sans-serif"


class RunPlots:
    """Mean node error and clearance since the start of the run, with what is wanted."""

    def __init__(self, gui: viser.GuiApi, scenario: Scenario) -> None:
        self._limits = (1e3 * scenario.run.tolerance, 1e3 * scenario.control.clearance)
        self._history = History(2)
        self._run = ""
        self._started = 0
        self._drawn = -math.inf
        self._stale = True
        titles = ("Mean distance to the goal [mm]", "Clearance of the rope [mm]")
        self._error = _chart(gui, titles[0], ("error", palette.BUSY), "tolerance")
        self._clearance = _chart(gui, titles[1], ("clearance", palette.GOAL), "wanted")
        self._result = gui.add_html("")

    def clear(self) -> None:
        """Forgets the run, for a jump in a recording."""
        self._history.clear()
        self._stale = True
        self._drawn = -math.inf

    def add(self, task: TaskState) -> None:
        """Takes the errors of a running task."""
        if (task.run, task.run_started) != (self._run, self._started):
            self._run, self._started = task.run, task.run_started
            self.clear()
        if task.run_started and task.state in (RUNNING, PAUSED):
            seconds = (task.stamp - task.run_started) / SECOND
            clearance = task.clearance if math.isfinite(task.clearance) else math.nan
            self._stale |= self._history.add(seconds, 1e3 * task.error, 1e3 * clearance)

    def result(self, message: RunResult) -> None:
        """Says how the run went."""
        self._result.content = result_html(message)

    def draw(self, now: float) -> None:
        """Brings the charts up to date, at most every `REFRESH` seconds."""
        if not self._stale or now - self._drawn < REFRESH:
            return
        self._drawn, self._stale = now, False
        time, error, clearance = self._history.columns
        for chart, values, limit in zip(
            (self._error, self._clearance), (error, clearance), self._limits, strict=True
        ):
            chart.data = (time, values, np.full(len(time), limit)) if len(time) else _blank(limit)


class ParameterTable:
    """The rope's parameters as the controller believes them, with its doubt."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._table = gui.add_html(_note("No parameters yet."))
        self._history = History(1)
        self._chart = _chart(
            gui, "Prediction error [mm]", ("prediction error", palette.WARNING), ""
        )
        self._first = 0
        self._drawn = -math.inf
        self._newest: Parameters | None = None

    def clear(self) -> None:
        """Forgets what was."""
        self._history.clear()
        self._first = 0
        self._drawn = -math.inf

    def add(self, message: Parameters) -> None:
        """Takes one estimate."""
        self._first = self._first or message.stamp
        seconds = (message.stamp - self._first) / SECOND
        self._history.add(seconds, 1e3 * message.prediction_error)
        self._newest = message

    def draw(self, now: float) -> None:
        """Brings table and chart up to date, at most every `REFRESH` seconds."""
        if self._newest is None or now - self._drawn < REFRESH:
            return
        self._drawn = now
        self._chart.data = self._history.columns
        self._table.content = parameter_html(self._newest)
        self._newest = None


def parameter_html(message: Parameters) -> str:
    """A table of values, standard deviations and units."""
    rows = "".join(
        f"<tr><td>{html.escape(p.name.replace('_', ' '))}</td>"
        f"<td style='text-align:right'>{p.value:.4g}</td>"
        f"<td style='opacity:.7'>{f'± {p.standard_deviation:.2g}' if p.standard_deviation else ''}"
        f"</td><td style='opacity:.7'>{html.escape(p.unit)}</td></tr>"
        for p in message.parameters
    )
    return (
        "<table style='margin:.5em 1em;font-size:.85em;border-spacing:.9em .25em;"
        f"margin-left:.2em'>{rows}</table>"
    )


def result_html(message: RunResult) -> str:
    """One sentence on a run that has ended, or on the one that goes on."""
    verdict = "reached" if message.reached else (message.reason or "not reached yet")
    text = (
        f"Run {message.run}: {verdict}, {message.duration:.1f} s, "
        f"mean error {1e3 * message.error:.2f} mm, "
        f"worst node {1e3 * message.max_node_error:.2f} mm, "
        f"least clearance {1e3 * message.min_clearance:.1f} mm, "
        f"{message.replans} path{'' if message.replans == 1 else 's'} planned again"
    )
    return _note(text)


def _note(text: str) -> str:
    return f"<div style='margin:.4em 1em;font-size:.85em;opacity:.8'>{html.escape(text)}</div>"


def _blank(limit: float) -> tuple[np.ndarray, ...]:
    """Axes and limit before there is a run to draw."""
    return np.array([0.0, 10.0]), np.array([0.0, np.nan]), np.full(2, limit)


def _chart(
    gui: viser.GuiApi, title: str, line: tuple[str, Color], limit: str
) -> viser.GuiUplotHandle:
    """One line over time, with a dashed one for its limit where that has a name."""
    name, color = line
    series: list[uplot.Series] = [
        {"label": "t [s]"},
        {
            "label": name,
            "stroke": palette.css(color),
            "fill": palette.css(color, 0.12),
            "width": 2,
            "points": {"show": False},
        },
    ]
    if limit:
        series.append(
            {
                "label": limit,
                "stroke": palette.css(palette.WARNING, 0.8),
                "width": 1,
                "dash": (6, 5),
                "points": {"show": False},
            }
        )
    grid: uplot.Axis_Grid = {"stroke": "rgba(255,255,255,0.07)", "width": 1}
    axis: uplot.Axis = {
        "stroke": INK,
        "grid": grid,
        "ticks": {"stroke": "rgba(255,255,255,0.15)", "width": 1, "size": 4},
        "font": FONT,
    }
    return gui.add_uplot(
        data=tuple(np.zeros(0) for _ in series),
        series=tuple(series),
        title=title,
        scales={"x": {"time": False, "auto": True}, "y": {"auto": True}},
        axes=(
            {**axis, "size": 24, "label": "time [s]", "labelSize": 16, "labelFont": FONT},
            {**axis, "size": 42},
        ),
        legend={"show": False},
        cursor={"drag": {"x": True, "y": False}},
        height=185,
        padding=(8, 14, 4, 0),
    )
