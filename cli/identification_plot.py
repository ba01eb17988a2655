"""Plot of a rod's prediction against the measured motion."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from lariat.identification import Prediction

mpl.use("Agg")
from matplotlib import pyplot as plt

MEASURED_COLOR, PREDICTED_COLOR = "#7a7a7a", "#d1495b"
SHAPE_COUNT = 6
"""Number of shapes that are drawn."""


def draw(prediction: Prediction, title: str, path: Path) -> None:
    """Draw shapes and middle vertex of the median sequence, and all errors over time."""
    motion, first = prediction.motion, prediction.first
    median = int(np.argsort(prediction.scores)[len(prediction.scores) // 2])
    measured, predicted = motion.vertices[median], prediction.vertices[median]
    seconds = motion.dt * np.arange(len(measured))
    figure, axes = plt.subplot_mosaic(
        [["shapes", "shapes"], ["middle", "errors"]],
        figsize=(11.0, 6.2),
        height_ratios=[1.0, 1.3],
        layout="constrained",
    )
    shapes, middle, errors = axes["shapes"], axes["middle"], axes["errors"]
    across = int(np.argmax(np.ptp(measured[..., :2], axis=(0, 1))))
    shift = 1.05 * float(np.ptp(measured[..., across]))
    for k, frame in enumerate(np.linspace(first, len(measured) - 1, SHAPE_COUNT).astype(int)):
        for chain, color in ((measured, MEASURED_COLOR), (predicted, PREDICTED_COLOR)):
            shapes.plot(
                chain[frame, :, across] + k * shift,
                chain[frame, :, 2],
                "o-",
                color=color,
                ms=3,
                lw=1,
            )
        left = float(measured[frame, 0, across])
        shapes.text(left + k * shift, measured[frame, 0, 2] + 0.03, f"{seconds[frame]:.1f} s")
    shapes.set_aspect("equal")
    shapes.set_title(f"{title}, sequence {median}, seen from the side, shifted")
    shapes.set(xticks=[], ylabel="height [m]")
    vertex = measured.shape[1] // 2
    for axis, style in zip(range(3), ("-", "--", ":"), strict=True):
        for chain, color, lw in (
            (measured, MEASURED_COLOR, 2.2),
            (predicted, PREDICTED_COLOR, 1.0),
        ):
            middle.plot(seconds, chain[:, vertex, axis], style, color=color, lw=lw)
    middle.plot([], [], color=MEASURED_COLOR, lw=2.2, label="measured")
    middle.plot([], [], color=PREDICTED_COLOR, lw=1.0, label="predicted")
    middle.set(title=f"vertex {vertex}: x –, y - -, z ···", xlabel="time [s]", ylabel="[m]")
    middle.legend(fontsize=8)
    for row in prediction.errors:
        errors.plot(seconds[first:], 100.0 * row, color=PREDICTED_COLOR, alpha=0.3, lw=0.8)
    errors.plot(
        seconds[first:], 100.0 * prediction.errors.mean(axis=0), color=PREDICTED_COLOR, lw=2
    )
    errors.set_title("mean absolute error of every sequence, and their mean")
    errors.set(xlabel="time [s]", ylabel="[cm]", ylim=(0.0, None))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)
    plt.close(figure)
