"""A picture of a rod's prediction against what was measured."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from shared.rod.identification import Prediction

mpl.use("Agg")
from matplotlib import pyplot as plt

MEASURED, PREDICTED = "#888888", "#d1495b"
SHAPES = 6


def draw(prediction: Prediction, title: str, path: Path) -> None:
    """The typical sequence's shapes and middle vertex, and all errors over time."""
    motion, first = prediction.motion, prediction.first
    typical = int(np.argsort(prediction.scores)[len(prediction.scores) // 2])
    measured, predicted = motion.vertices[typical], prediction.vertices[typical]
    seconds = motion.dt * np.arange(len(measured))
    figure, (shapes, middle, errors) = plt.subplots(1, 3, figsize=(13.0, 3.8), layout="constrained")
    span = measured[:, -1] - measured[:, 0]
    across = int(np.argmax(np.mean(np.abs(span[:, :2]), axis=0)))
    shift = 0.9 * float(np.ptp(measured[..., across]))
    for k, frame in enumerate(np.linspace(first, len(measured) - 1, SHAPES).astype(int)):
        for chain, color in ((measured, MEASURED), (predicted, PREDICTED)):
            shapes.plot(
                chain[frame, :, across] + k * shift,
                chain[frame, :, 2],
                "o-",
                color=color,
                ms=2.5,
                lw=1,
            )
        shapes.annotate(
            f"{seconds[frame]:.1f} s",
            (k * shift + float(np.mean(measured[frame, :, across])), float(measured[..., 2].max())),
            ha="center",
        )
    shapes.set_aspect("equal")
    shapes.set(title=f"{title}: side view, shifted", xticks=[], ylabel="height [m]")
    vertex = measured.shape[1] // 2
    for axis, style in zip(range(3), ("-", "--", ":"), strict=True):
        for chain, color, what in (
            (measured, MEASURED, "measured"),
            (predicted, PREDICTED, "predicted"),
        ):
            middle.plot(
                seconds,
                chain[:, vertex, axis],
                style,
                color=color,
                lw=1.2,
                label=f"{'xyz'[axis]} {what}",
            )
    middle.set(title=f"vertex {vertex}", xlabel="time [s]", ylabel="[m]")
    middle.legend(fontsize=6, ncols=3)
    for row in prediction.errors:
        errors.plot(seconds[first:], 100.0 * row, color=PREDICTED, alpha=0.3, lw=0.8)
    errors.plot(seconds[first:], 100.0 * prediction.errors.mean(axis=0), color=PREDICTED, lw=2)
    errors.set(title="mean absolute error", xlabel="time [s]", ylabel="[cm]", ylim=(0.0, None))
    figure.savefig(path, dpi=90)
    plt.close(figure)
