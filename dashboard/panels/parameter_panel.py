"""Rope parameters as the controller estimates them."""

from __future__ import annotations

import html
import math

import viser

from dashboard import palette
from dashboard.panels.chart import REFRESH_PERIOD, add_chart
from dashboard.panels.note import note_html
from shared.history import History
from shared.messages import Parameters
from shared.messages.parameters import named_parameters
from shared.service import SECOND


class ParameterPanel:
    """Table of the parameters with standard deviations, and a chart of the prediction error."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._table = gui.add_html(note_html("No parameters yet."))
        self._history = History(1)
        self._chart = add_chart(gui, "Prediction error [mm]", "prediction error", palette.WARNING)
        self._first_stamp = 0
        self._draw_time = -math.inf
        self._undrawn: Parameters | None = None

    def clear(self) -> None:
        """Drop the history, for a jump in a recording."""
        self._history.clear()
        self._first_stamp = 0
        self._draw_time = -math.inf

    def add(self, message: Parameters) -> None:
        """Add an estimate."""
        self._first_stamp = self._first_stamp or message.stamp
        seconds = (message.stamp - self._first_stamp) / SECOND
        self._history.add(seconds, 1e3 * message.prediction_error)
        self._undrawn = message

    def draw(self, now: float) -> None:
        """Draw table and chart if they have changed, at most every `REFRESH_PERIOD`.

        Args:
            now: Present time [s].
        """
        if self._undrawn is None or now - self._draw_time < REFRESH_PERIOD:
            return
        self._draw_time = now
        self._chart.data = self._history.columns
        self._table.content = table_html(self._undrawn)
        self._undrawn = None


def table_html(message: Parameters) -> str:
    """HTML table of values, standard deviations and units."""
    rows = "".join(
        f"<tr><td>{html.escape(p.name.replace('_', ' '))}</td>"
        f"<td style='text-align:right'>{p.value:.4g}</td>"
        f"<td style='opacity:.7'>{f'± {p.standard_deviation:.2g}' if p.standard_deviation else ''}"
        f"</td><td style='opacity:.7'>{html.escape(p.unit)}</td></tr>"
        for p in named_parameters(message)
    )
    return (
        "<table style='margin:.5em 1em;font-size:.85em;border-spacing:.9em .25em;"
        f"margin-left:.2em'>{rows}</table>"
    )
