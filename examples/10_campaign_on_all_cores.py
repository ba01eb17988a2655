"""Campaign on all cores: closed-loop runs in random scenes, one process for each core."""

from __future__ import annotations

import os

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from benchmarks.campaign import Campaign
from benchmarks.goals.trial import Trial, TrialSpec, restore, run_trial


def line(trial: Trial) -> str:
    return f"{trial.spec.kind}-{trial.spec.number}: {trial.score.final_error_mm} mm, {trial.reason}"


def main(count: int = 8, workers: int = os.cpu_count() or 1) -> Figure:
    settings = ("plant.model=rod", "sensing.source=truth", "run.time_limit=4.0")
    specs = [TrialSpec("easy", number, 7, settings) for number in range(count)]
    trials = Campaign(run_trial, restore, line).trials(specs, workers=workers)
    print(f"{sum(trial.succeeded for trial in trials)} of {count} as wanted")
    figure = plt.figure()
    axes = figure.add_subplot(projection="3d")
    for color, trial in enumerate(trials):
        axes.plot(*np.array(trial.ends[0]).T, color="0.7")
        axes.plot(*np.array(trial.ends[-1]).T, color=f"C{color % 10}")
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    return figure


if __name__ == "__main__":  # processes that are spawned import this file
    main().savefig("10_campaign_on_all_cores.png")
