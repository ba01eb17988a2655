"""Plots of benches, without a display."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lariat.configuration import ConfigurationError


def figure_of(rows: int, columns: int, size: tuple[float, float], **options: Any) -> Any:
    """Return a figure of a width and height [inch], and its axes, by the options of `subplots`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def save(figure: Any, path: Path) -> None:
    """Write a figure with grids and, where there are labels, legends."""
    for axes in figure.axes:
        axes.grid(alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=7)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=90)
    except OSError as error:
        raise ConfigurationError(f"cannot write {path}: {error}") from error
