"""Plots of trials: the rope on its way, and distributions over all trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from benchmarks.goals.campaign import Trial
from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle

VIEWS = (("from above", 0, 1), ("from the front", 0, 2), ("from the side", 1, 2))
"""Names of the views, and the coordinates that they show."""


def plot_trial(trial: Trial, path: Path) -> None:
    """Plot the rope on its way from three sides, with goal (green), end (red) and obstacles."""
    figure, axes = plt.subplots(1, 3, figsize=(15, 5))
    for axis, (name, first, second) in zip(axes, VIEWS, strict=True):
        axis.set_title(name)
        for obstacle in trial.obstacles:
            _outline(axis, obstacle, first, second)
        for k, nodes in enumerate(trial.shapes[::2]):
            shade = str(0.85 - 0.6 * 2 * k / max(len(trial.shapes), 1))
            axis.plot(nodes[:, first], nodes[:, second], color=shade, linewidth=0.7)
        for nodes, color in ((trial.goal, "tab:green"), (trial.shapes[-1], "tab:red")):
            axis.plot(nodes[:, first], nodes[:, second], color=color, linewidth=2.0)
        points = np.concatenate([trial.goal, *trial.shapes])
        low, high = points.min(axis=0) - 0.08, points.max(axis=0) + 0.08
        axis.set_xlim(low[first], high[first])
        axis.set_ylim(low[second], high[second])
        axis.set_aspect("equal")
        axis.set_xlabel(f"{'xyz'[first]} [m]")
        axis.set_ylabel(f"{'xyz'[second]} [m]")
    score = trial.score
    figure.suptitle(
        f"{score.scenario} {trial.variant}: error {score.final_error_mm} mm, clearance "
        f"{score.min_clearance_mm} mm; {trial.reason}\n{trial.conditions}"
    )
    figure.savefig(path, dpi=70, bbox_inches="tight")
    plt.close(figure)


def plot_summary(groups: dict[str, Sequence[Trial]], path: Path) -> None:
    """Plot the distributions of error, clearance and time, one line for each group."""
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.6))
    names = ("final error [mm]", "least clearance [mm]", "time to goal [s]")
    for axis, name in zip(axes, names, strict=True):
        axis.set_xlabel(name)
        axis.set_ylabel("share of the trials")
    for label, trials in groups.items():
        columns = (
            [t.score.final_error_mm for t in trials],
            [t.score.min_clearance_mm for t in trials],
            [t.score.reached_s for t in trials],
        )
        for axis, column in zip(axes, columns, strict=True):
            values = np.sort([v for v in column if v is not None])
            axis.step(values, np.arange(1, len(values) + 1) / len(trials), label=label)
    axes[0].set_xscale("log")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    plt.close(figure)


def _outline(axis: Axes, obstacle: Obstacle, first: int, second: int) -> None:
    """Draw the projection of an obstacle: the hull of the corners of its surface."""
    if obstacle.shape == "half_space":
        return
    points = obstacle.row.mesh(obstacle.packed_sizes).points
    world = poses.rotate(np.array(obstacle.orientation), points) + np.array(obstacle.position)
    flat = world[:, (first, second)]
    hull = cv2.convexHull(flat.astype(np.float32))[:, 0]
    axis.fill(*hull.T, color="tab:blue", alpha=0.25)
