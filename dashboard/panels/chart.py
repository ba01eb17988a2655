"""Charts of a quantity over time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import numpy as np
import viser
from jaxtyping import Float64
from viser import uplot

from dashboard import palette
from dashboard.palette import Color

REFRESH_PERIOD = 1.0 / 3.0
"""Least time between two drawings of a chart [s]."""
TEXT_FONT = "11px sans-serif"
"""CSS font of axes and labels."""
CHART_HEIGHT = 185
"""Height of a chart [pixels]."""
MARK_WIDTH = 1e-3
"""Time between the two ends of an upright line, which no screen shows [s]."""
EMPTY_CHART_SPAN = 10.0
"""Time that a chart spans before there is anything to draw [s]."""
COMPARISON_COLORS = (
    palette.BUSY,
    palette.WARNING,
    palette.GOOD,
    palette.TRUTH,
    palette.BAD,
    palette.PATH,
)
"""Colours of the runs of a comparison."""
Curve = tuple[Float64[np.ndarray, "n"], Float64[np.ndarray, "n"]]
"""Times [s] and values of a line."""
EARLIER_RUNS = 3
"""Number of earlier runs that are drawn behind the present one [-]."""


def add_chart(
    gui: viser.GuiApi,
    title: str,
    label: str,
    color: Color,
    limit_label: str = "",
    with_earlier_runs: bool = False,
) -> viser.GuiUplotHandle:
    """Add a chart with one line, and a dashed line for its limit if that has a label.

    The columns of its data are time, limit, the line and those of earlier runs.
    """
    series = []
    if limit_label:
        series.append(_line(limit_label, palette.css(palette.WARNING, 0.8), 1, dash=(6, 5)))
    series.append(_line(label, palette.css(color)))
    for age in range(1, 1 + EARLIER_RUNS * with_earlier_runs):
        name = f"{label}, {age} run{'s' if age > 1 else ''} before"
        series.append(_line(name, palette.css(color, 0.6 / age), 1))
    return _plot(gui, title, series)


def add_comparison_chart(
    gui: viser.GuiApi, title: str, names: Sequence[str], curves: Sequence[Curve]
) -> viser.GuiUplotHandle:
    """Add a chart of several runs.

    Other runs need another chart, which has its curves from its first drawing: viser keeps the part
    of the time axis that was seen before, be it nothing.
    """
    # Told apart by colour and dashes.
    colors = cycle(palette.css(color) for color in COMPARISON_COLORS)
    lines = [
        _line(name, color, dash=dash)
        for name, color, dash in zip(names or ["no run"], colors, cycle(((), (8, 4))), strict=False)
    ]
    return _plot(gui, title, lines, overlay(curves) if curves else (), with_legend=True)


def add_estimate_chart(gui: viser.GuiApi, title: str, color: Color) -> viser.GuiUplotHandle:
    """Add a chart of an estimate over several runs.

    The columns of its data are time, true value, estimate, estimate plus and minus sigma, and the
    marks of the runs' starts (`with_marks`).
    """
    edge = _line("± σ", palette.css(color, 0.35), 1)
    series = (
        _line("true value (simulation)", palette.css(palette.TRUTH), 1, dash=(6, 5)),
        _line("estimate", palette.css(color)),
        edge,
        edge,
        _line("start of a run", palette.css(palette.QUIET, 0.8), 1),
    )
    chart = _plot(gui, title, series)
    chart.bands = ({"series": (3, 4), "fill": palette.css(color, 0.15)},)
    return chart


def _line(label: str, color: str, width: int = 2, dash: tuple[int, ...] = ()) -> uplot.Series:
    line: uplot.Series = {
        "label": label,
        "stroke": color,
        "width": width,
        "points": {"show": False},
    }
    return {**line, "dash": dash} if dash else line


def overlay(curves: Sequence[Curve]) -> tuple[np.ndarray, ...]:
    """Columns of a chart whose curves have times of their own."""
    finite = [(t, values, np.isfinite(values)) for t, values in curves]
    drawn = [(t[mask], values[mask]) for t, values, mask in finite if np.any(mask)]
    times = np.unique(np.concatenate([np.zeros(0), *(t for t, _ in drawn)]))
    if not drawn:
        nothing = np.array([0.0, np.nan])
        return np.array([0.0, EMPTY_CHART_SPAN]), *[nothing] * max(len(curves), 1)
    rows = [
        np.interp(times, t[mask], values[mask], right=np.nan) if np.any(mask) else times * 0.0
        for t, values, mask in finite
    ]
    return times, *rows


def with_marks(columns: tuple[np.ndarray, ...], times: Sequence[float]) -> tuple[np.ndarray, ...]:
    """Return the columns of a chart with one more: upright lines at some times."""
    begin, end = columns[0][0], columns[0][-1]
    starts = np.unique([t for t in times if begin <= t <= end])
    marked = np.unique(np.concatenate([columns[0], starts, starts + MARK_WIDTH]))
    values = [np.interp(marked, columns[0], row) for row in columns[1:]]
    low, high = np.nanmin(values), np.nanmax(values)
    marks = np.where(np.isin(marked, starts + MARK_WIDTH), high, np.nan)
    marks[np.isin(marked, starts)] = low
    # The charts' library finds no range where a first value is NaN.
    marks[0] = low
    return marked, *values, marks


def _plot(
    gui: viser.GuiApi,
    title: str,
    lines: Sequence[uplot.Series],
    data: tuple[np.ndarray, ...] = (),
    with_legend: bool = False,
) -> viser.GuiUplotHandle:
    series: tuple[uplot.Series, ...] = ({"label": "t [s]"}, *lines)
    # A chart whose first data were empty would keep a time axis from NaN to NaN.
    times, nothing = overlay(())
    # Without colours of its own, an axis has those of the window's theme.
    axis: uplot.Axis = {
        "grid": {"width": 1},
        "ticks": {"width": 1, "size": 4},
        "font": TEXT_FONT,
    }
    return gui.add_uplot(
        data=data or (times, *[nothing] * len(lines)),
        # Axes are those of data.
        visible=bool(data),
        series=series,
        title=title,
        scales={"x": {"time": False, "auto": True}, "y": {"auto": True}},
        axes=(
            {**axis, "size": 24, "label": "time [s]", "labelSize": 16, "labelFont": TEXT_FONT},
            {**axis, "size": 42},
        ),
        legend={"show": with_legend},
        cursor={"drag": {"x": True, "y": False}},
        height=CHART_HEIGHT,
        padding=(8, 14, 4, 0),
    )
