"""Charts of a quantity over time."""

from __future__ import annotations

import numpy as np
import viser
from viser import uplot

from dashboard import palette
from dashboard.palette import Color

REFRESH_PERIOD = 0.2
"""Least time between two drawings of a chart [s]."""
TEXT_COLOR = "#aab4c3"
"""CSS colour of axes and labels."""
TEXT_FONT = "11px sans-serif"
"""CSS font of axes and labels."""
CHART_HEIGHT = 185
"""Height of a chart [pixels]."""
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

    Args:
        gui: The page's GUI.
        title: Quantity and unit.
        label: Label of the line.
        color: Colour of the line.
        limit_label: Label of the limit.
        with_earlier_runs: Whether `EARLIER_RUNS` more lines are drawn, dimmer with their age.
    """
    series: list[uplot.Series] = [{"label": "t [s]"}]
    if limit_label:
        series.append(
            {
                "label": limit_label,
                "stroke": palette.css(palette.WARNING, 0.8),
                "width": 1,
                "dash": (6, 5),
                "points": {"show": False},
            }
        )
    series.append(
        {
            "label": label,
            "stroke": palette.css(color),
            "fill": palette.css(color, 0.12),
            "width": 2,
            "points": {"show": False},
        }
    )
    for age in range(1, 1 + EARLIER_RUNS * with_earlier_runs):
        series.append(
            {
                "label": f"{label}, {age} run{'s' if age > 1 else ''} before",
                "stroke": palette.css(color, 0.6 / age),
                "width": 1,
                "points": {"show": False},
            }
        )
    grid: uplot.Axis_Grid = {"stroke": "rgba(255,255,255,0.07)", "width": 1}
    axis: uplot.Axis = {
        "stroke": TEXT_COLOR,
        "grid": grid,
        "ticks": {"stroke": "rgba(255,255,255,0.15)", "width": 1, "size": 4},
        "font": TEXT_FONT,
    }
    return gui.add_uplot(
        data=tuple(np.zeros(0) for _ in series),
        series=tuple(series),
        title=title,
        scales={"x": {"time": False, "auto": True}, "y": {"auto": True}},
        axes=(
            {**axis, "size": 24, "label": "time [s]", "labelSize": 16, "labelFont": TEXT_FONT},
            {**axis, "size": 42},
        ),
        legend={"show": False},
        cursor={"drag": {"x": True, "y": False}},
        height=CHART_HEIGHT,
        padding=(8, 14, 4, 0),
    )
