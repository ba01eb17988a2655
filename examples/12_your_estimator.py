"""Your state estimator: a class that says where the rope is between two images."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from examples.methods.carried import Carried
from lariat.scenario.settings import load_with
from lariat.trajectory import SECOND
from stack.simulation import closed_loop

SETTINGS = ("sensing.source=truth", "sensing.latency=0.06", "run.time_limit=4.0")
"""True nodes, 60 ms old."""
YOURS = f"{Carried.__module__}:{Carried.__name__}"
"""Name of the class, as a scenario gives it."""


def main(estimators: tuple[str, ...] = ("rod", YOURS)) -> Figure:
    figure, axes = plt.subplots()
    for estimator in estimators:
        settings = (*SETTINGS, f"control.state_estimator={estimator}")
        outcome = closed_loop.run(load_with(Path("three-cylinders"), settings))
        name = estimator.rpartition(":")[2]
        print(f"{name}: error {outcome.score.final_error_mm:.2f} mm, {outcome.reason}")
        stamps, errors, _ = np.array(outcome.scorer.errors).T
        axes.semilogy((stamps - stamps[0]) / SECOND, 1e3 * errors, label=name)
    axes.set(xlabel="time [s]", ylabel="error [mm]")
    axes.legend()
    return figure


if __name__ == "__main__":
    main().savefig("12_your_estimator.png")
