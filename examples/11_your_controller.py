"""Your controller: a class behind a protocol drives the closed loop, beside Lariat's own."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from examples.methods.shape_servo import ShapeServo
from lariat.scenario.settings import load_with
from lariat.trajectory import SECOND
from stack.simulation import closed_loop

SETTINGS = (
    "goal.line=[[-0.16, -0.10, 0.36], [0.18, -0.14, 0.34]]",
    "control.planner=false",
    "sensing.source=truth",
    "run.time_limit=3.0",
)
"""Goal in front of the cylinders, without a planned path."""
YOURS = f"{ShapeServo.__module__}:{ShapeServo.__name__}"
"""Name of the class, as a scenario gives it."""


def main(methods: tuple[str, ...] = ("gauss_newton", YOURS)) -> Figure:
    figure, axes = plt.subplots()
    for method in methods:
        settings = (*SETTINGS, f"control.method={method}")
        outcome = closed_loop.run(load_with(Path("three-cylinders"), settings))
        name = method.rpartition(":")[2]
        print(f"{name}: error {outcome.score.final_error_mm:.2f} mm, {outcome.reason}")
        stamps, errors, _ = np.array(outcome.scorer.errors).T
        axes.semilogy((stamps - stamps[0]) / SECOND, 1e3 * errors, label=name)
    axes.set(xlabel="time [s]", ylabel="error [mm]")
    axes.legend()
    return figure


if __name__ == "__main__":
    main().savefig("11_your_controller.png")
