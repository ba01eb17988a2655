"""Rope parameters as the controller estimates them."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.markup import escaped, note_html
from dashboard.outbox import Outbox
from dashboard.panels.chart import (
    REFRESH_PERIOD,
    add_chart,
    add_estimate_chart,
    with_marks,
)
from lariat.rope_parameters import PUBLISHED, Values
from lariat.scenario import Scenario
from lariat.scenario.rod_properties import rod_properties
from lariat.trajectory import SECOND
from shared.history import History
from shared.messages import Parameters, TaskRequest, TaskState
from shared.messages.parameters import NamedParameter, described, named_parameters

ADAPT = "adapt"
"""Setting of the controller that switches the adaptation."""
MAX_MARKS = 100
"""Largest number of runs whose starts are marked [-]."""
FIRST_PARAMETER = "bending_stiffness"
"""Parameter that is drawn first."""


class ParameterPanel:
    """Table of the parameters; charts of one over all runs and of the prediction."""

    def __init__(
        self,
        gui: viser.GuiApi,
        scenario: Scenario,
        actions: ActionQueue,
        outbox: Outbox,
        live: bool,
    ) -> None:
        self._adapt = gui.add_checkbox(
            "Adapt",
            False,
            disabled=True,
            visible=live,
            hint="Estimate the rope's parameters from what the camera sees; during a run, too",
        )
        actions.on_change(
            self._adapt,
            lambda value: outbox.request_task(
                TaskRequest.SET, "Adapt", key=ADAPT, value="true" if value is True else "false"
            ),
        )
        self._shown_task = -1, ""
        """Revision and last request of the task that the switch shows."""
        self._truth = true_values(scenario)
        self._table = gui.add_html(note_html("No parameters yet."))
        self._selection = gui.add_dropdown("Over time", (FIRST_PARAMETER,))
        actions.on_change(self._selection, self._select)
        self._estimate = add_estimate_chart(gui, FIRST_PARAMETER, palette.ROPE)
        self._histories: dict[str, History] = {}
        self._selected = FIRST_PARAMETER
        self._history = History(1)
        self._chart = add_chart(gui, "Prediction error [mm]", "prediction error", palette.WARNING)
        self._first_stamp = 0
        self._run_starts: deque[int] = deque(maxlen=MAX_MARKS)
        """Starts of the runs [ns]."""
        self._draw_time = -math.inf
        self._undrawn: Parameters | None = None
        self._newest: Parameters | None = None

    def clear(self) -> None:
        """Drop the history, for a jump in a recording."""
        self._history.clear()
        self._histories.clear()
        self._run_starts.clear()
        self._first_stamp = 0
        self._draw_time = -math.inf

    def add(self, message: Parameters) -> None:
        """Add an estimate."""
        self._first_stamp = self._first_stamp or message.stamp
        seconds = (message.stamp - self._first_stamp) / SECOND
        self._history.add(seconds, 1e3 * message.prediction_error)
        for parameter in named_parameters(message):
            if parameter.name not in self._histories:
                self._histories[parameter.name] = History(2)
            self._histories[parameter.name].add(
                seconds, parameter.value, parameter.standard_deviation
            )
        self._undrawn = self._newest = message

    def mark_run(self, task: TaskState) -> None:
        """Take the start of the task's run, which the chart marks."""
        if task.run_started and task.run_started not in self._run_starts:
            self._run_starts.append(task.run_started)

    def update(self, task: TaskState | None) -> None:
        """Show whether the controller adapts."""
        self._adapt.disabled = task is None or ADAPT not in task.settings
        if task is None or (task.revision, task.last_request) == self._shown_task:
            return
        self._shown_task = task.revision, task.last_request
        self._adapt.value = task.settings.get(ADAPT) == "true"

    def draw(self, now: float) -> None:
        """Draw table and charts if they have changed, at most every `REFRESH_PERIOD`."""
        if self._undrawn is None or now - self._draw_time < REFRESH_PERIOD:
            return
        self._draw_time = now
        self._chart.data = self._history.columns
        self._chart.visible = True
        parameters = named_parameters(self._undrawn)
        self._table.content = table_html(parameters)
        names = tuple(p.name for p in parameters)
        if names and tuple(self._selection.options) != names:
            self._selection.options = names  # pyright: ignore[reportAttributeAccessIssue]
            self._selected = self._selection.value
        self._draw_estimate({p.name: p.unit for p in parameters})
        self._undrawn = None

    def _select(self, name: str) -> None:
        self._selected = name
        self._undrawn, self._draw_time = self._newest, -math.inf

    def _draw_estimate(self, units: dict[str, str]) -> None:
        history = self._histories.get(self._selected)
        if history is None or not len(history):
            return
        time, value, sigma = history.columns
        truth = self._truth.get(self._selected, math.nan)
        truth_line = np.full(len(time), truth) if math.isfinite(truth) else value
        rows = (truth_line, value, value + sigma, value - sigma)
        self._estimate.title = (
            f"{self._selected.replace('_', ' ')} [{units.get(self._selected, '')}]"
        )
        starts = [(start - self._first_stamp) / SECOND for start in self._run_starts]
        self._estimate.data = with_marks((time, *rows), starts)
        self._estimate.visible = True


def true_values(scenario: Scenario) -> dict[str, float]:
    """Return the true parameters of the simulated rope by name; none where an arm is real."""
    if not scenario.simulated:
        return {}
    rope = rod_properties(scenario.plant_rope)
    values = {p.name: float(p.of(rope)[0]) for p in PUBLISHED if p.values is Values.SCALAR}
    return {name: value for name, value in values.items() if math.isfinite(value)}


def table_html(parameters: list[NamedParameter]) -> str:
    """HTML table of values, standard deviations and units."""
    rows = "".join(
        f"<tr><td>{escaped(described(p.name)[0])}</td>"
        f"<td style='text-align:right'>{p.value:.4g}</td>"
        f"<td style='opacity:.7'>{f'± {p.standard_deviation:.2g}' if p.standard_deviation else ''}"
        f"</td><td style='opacity:.7'>{escaped(p.unit)}</td></tr>"
        for p in parameters
    )
    return (
        "<table style='margin:.5em 1em;font-size:.85em;border-spacing:.9em .25em;"
        f"margin-left:.2em'>{rows}</table>"
    )
