"""The paper's simulations on its rod and on Lariat's: `lariat bench paper`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.campaign import CAMPAIGN_DEFAULTS, CampaignOptions, Trial, groups
from benchmarks.paper.closed_loop import PAPER_TIME_STEP
from benchmarks.paper.studies import (
    ADAPTATION_STUDIES,
    COMPLIANCE_RATIO,
    ShapingSpec,
    Study,
    adaptation_row,
    error_mm,
    row,
    run_trial,
    studies,
)
from benchmarks.plots import figure_of, save
from benchmarks.tables import Flat, Result
from lariat.configuration import ConfigurationError

STUDY_CONDITIONS = (
    "Plant = model, n = 40, state known (along a planned path: true nodes sensed); not adapting "
    "unless stated. Error: mean node distance to the goal, last 0.2 s."
)
ADAPTATION_CONDITIONS = (
    f"Plant: xpbd, n = 40, {COMPLIANCE_RATIO:g} times as soft as the model; true nodes sensed"
)


def run(
    goals: int = 10,
    seeds: int = 3,
    steps: int = 400,
    seed: int = 0,
    adaptation_goals: int = 5,
    only: tuple[str, ...] = (),
    plot: Path | None = None,
    options: Flat[CampaignOptions] = CAMPAIGN_DEFAULTS,
) -> int:
    """Run the paper's simulations: ten goals behind three cylinders, by its methods and Lariat's.

    The methods are the paper's network, Adam on the actions, and Gauss-Newton; model and plant are
    the same rod, the paper's (xpbd) or Lariat's (direct), each with 40 nodes, whose state is known.
    The same goals by the whole stack, and the paper's online adaptation follow.

    Examples:
      lariat bench paper --plot docs/results/reproduction.png --workers 2 --results paper.jsonl
      lariat bench paper --goals 2 --seeds 1 --adaptation-goals 1
      lariat bench paper --only actions --goals 3

    Args:
        goals: Number of goals.
        seeds: Number of networks with different initial weights.
        steps: Number of steps T of a run, of 10 ms each.
        seed: Seed of the goals.
        adaptation_goals: Number of goals of the adaptation studies.
        only: Words of the studies to run; all studies by default.
        plot: File for the counterpart of the paper's Fig. 9, a PNG.

    Returns:
        0 if the network on the paper's rod is as accurate as the paper says, else 1.
    """
    counts = dict.fromkeys(studies(seeds), goals)
    counts |= dict.fromkeys(ADAPTATION_STUDIES, adaptation_goals)
    specs = [
        ShapingSpec(study, k, seed, steps)
        for study, count in counts.items()
        if all(word in study.name for word in only)
        for k in range(count)
    ]
    if not specs:
        raise ConfigurationError(f"no study has all of the words {', '.join(only)}")
    trials = options.trials(run_trial, specs)
    by_study: dict[Study, list[Trial]] = {s: t for (s,), t in groups(trials, "study").items()}
    softer = {study: by_study[study] for study in ADAPTATION_STUDIES if study in by_study}
    tables = [Result("studies", [row(*one) for one in by_study.items()], STUDY_CONDITIONS)]
    if softer:
        rows = [adaptation_row(*one) for one in softer.items()]
        tables.append(Result("adaptation", rows, ADAPTATION_CONDITIONS))
    options.publish(*tables)
    if plot is not None:
        _draw({s: t for s, t in by_study.items() if s not in softer}, softer, plot)
    return 0 if all(_reproduced(*one) for one in by_study.items()) else 1


def _reproduced(study: Study, trials: Sequence[Trial]) -> bool:
    """Whether the network on the paper's rod is as accurate as the paper says; others count not."""
    if (study.method, study.solver, study.softer) != ("network", "xpbd", 1.0):
        return True
    errors = [error_mm(t) for t in trials]
    accurate = np.mean(errors) <= 3.0 and sum(e < 5.0 for e in errors) >= 0.9 * len(errors)
    return bool(accurate) and min(t["clearance_mm"] for t in trials) > 0.0


def _draw(
    methods: Mapping[Study, Sequence[Trial]],
    adaptation: Mapping[Study, Sequence[Trial]],
    path: Path,
) -> None:
    """Draw the paper's Fig. 9: error over time by method, and with and without adaptation."""
    figure, (left, right) = figure_of(1, 2, (11.0, 4.2), sharey=True)
    for axes, of_method in ((left, methods), (right, adaptation)):
        for study, trials in of_method.items():
            if study.method == "whole_path":
                continue
            errors = np.array([trial["errors_mm"] for trial in trials])
            times = PAPER_TIME_STEP * np.arange(1, errors.shape[1] + 1)
            (line,) = axes.plot(times, errors.mean(axis=0), label=study.name, lw=1.3)
            low, high = np.percentile(errors, (10, 90), axis=0)
            axes.fill_between(times, low, high, color=line.get_color(), alpha=0.12, lw=0)
        axes.set(yscale="log", xlabel="time [s]")
    left.set_ylabel("mean node distance to the goal [mm]")
    left.set_title("methods; mean and 10 to 90 % of the goals", fontsize=9)
    right.set_title("the paper's rod, plant softer than believed", fontsize=9)
    save(figure, path)
