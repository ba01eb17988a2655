"""Runs with hidden ropes, grips and simulators: `lariat bench robustness`.

Each combination is a shipped scenario with another simulator, resolution, stiffness and length of
the rope, held off the believed grips; it is seen by the camera, and the controller adapts. Its goal
is a rest shape of the true rope as truly held, at the scenario's grips or at seeded ones.
"""

from __future__ import annotations

import json as encoder
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from benchmarks.campaign import Campaign, Workers
from benchmarks.robustness.combinations import Combination, sample
from benchmarks.robustness.tables import write_table
from benchmarks.robustness.trial import (
    MAX_ERROR,
    MAX_ERROR_ON_SUPPORT,
    MAX_STIFFNESS_ERROR,
    Trial,
    run_trial,
)
from lariat.configuration import ConfigurationError


def run(
    count: int = 60,
    first: int = 0,
    seed: int = 0,
    only: tuple[int, ...] = (),
    scenario: tuple[str, ...] = (),
    adapt: bool = True,
    folder: Path = Path("robustness-trials"),
    again: bool = False,
    workers: Workers = 1,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Run combinations of hidden ropes, grips and simulators in closed loop.

    Finished runs are kept in FOLDER/trials.jsonl and are not run again, so that an interrupted
    campaign goes on where it was. FOLDER/SEED-NUMBER holds scenario and goal of each, for
    `lariat run FOLDER/SEED-NUMBER/scenario.toml`.

    Examples:
      lariat bench robustness --workers 2 --docs docs/results
      lariat bench robustness --only 17 --again
      lariat bench robustness --scenario rope cable --count 12 --seed 1

    Args:
        count: Number of combinations.
        first: Number of the first one.
        seed: Seed of the combinations.
        only: Numbers of single combinations, in place of `count` and `first`.
        scenario: Names of shipped scenarios; by default all with one rope.
        adapt: Whether the controller adapts the rope's parameters. Without, a run may give up.
        folder: Folder for finished runs, scenarios and goals.
        again: Run finished combinations again.
        workers: Number of processes, or the address of a Dask scheduler.
        docs: Folder in which `robustness/table.csv` is written; nothing is by default.
        json: Print one JSON object instead of a table.

    Returns:
        0 if all combinations ran to their goals, touched nothing and found the stiffness where
        the shapes tell it, else 1; without adaptation, if all that missed their goals gave up.
    """
    numbers = only or range(first, first + count)
    combinations = [sample(seed, number, scenario, adapt) for number in numbers]
    campaign = Campaign(partial(run_trial, folder), Trial, _line)
    trials = campaign.trials(combinations, folder / "trials.jsonl", workers, again)
    refused = len(combinations) - len(trials)
    combinations = [trial.spec for trial in trials]
    if not trials:
        raise ConfigurationError("none of the combinations can be run; take another seed")
    if docs:
        write_table(docs / "robustness" / "table.csv", trials, combinations)
    if json:
        figures = {k: v if np.isfinite(v) else None for k, v in summary(trials).items()}
        print(encoder.dumps({"summary": figures, "trials": [asdict(t) for t in trials]}))
    else:
        _print(trials, combinations, scenario)
    return 1 if refused or any(t.faults for t in trials) else 0


def _line(trial: Trial) -> str:
    return f"{trial.spec}: {', '.join(trial.faults) or 'good'}"


def summary(trials: Sequence[Trial]) -> dict[str, float]:
    """Return counts and statistics of several runs."""
    errors = [t.error_mm for t in trials]
    told = [t for t in trials if t.told]
    clearances = [c for t in trials if (c := t.score["min_clearance_mm"]) is not None]
    return {
        "runs": len(trials),
        "good": sum(not t.faults for t in trials),
        "at the goal": sum(t.near for t in trials),
        "gave up": sum(t.stopped for t in trials),
        "touched": sum(t.touched for t in trials),
        "median error [mm]": float(np.median(errors)),
        "90 % of the errors below [mm]": float(np.quantile(errors, 0.9, method="higher")),
        "median error of the shape [mm]": float(np.nanmedian([t.shape_error_mm for t in trials])),
        "shape within 1 mm": sum(t.shape_error_mm <= MAX_ERROR for t in trials),
        "least clearance [mm]": min(clearances, default=np.nan),
        "shapes tell the stiffness": len(told),
        "stiffness within 10 % there": sum(t.stiffness_found for t in told),
        "horizon error within twice the noise": sum(t.foresees for t in trials),
        "median horizon error / noise": float(np.nanmedian([t.noise_ratio for t in trials])),
    }


def _print(
    trials: Sequence[Trial], combinations: Sequence[Combination], scenario: tuple[str, ...]
) -> None:
    table = Table(
        caption=(
            "camera; error: mean node distance of true rope and goal, last 0.2 s; "
            "shape: mean distance of their curves; "
            "place: least standard deviation of the nodes along the rope that the shapes admit; "
            "EI found: share of the true stiffness ± stated standard deviation, in brackets where "
            "start and goal do not tell it; horizon: its prediction error in units of the noise"
        )
    )
    for name in (
        "",
        "scenario",
        "goal",
        "plant",
        "EI x",
        "error mm",
        "shape mm",
        "place mm",
        "clear mm",
        "EI found",
        "horizon",
    ):
        table.add_column(name)
    for trial, combination in zip(trials, combinations, strict=True):
        found, deviation = trial.stiffness
        stiffness = f"{found:.2f} ± {deviation:.2f}"
        clearance = trial.score["min_clearance_mm"]
        table.add_row(
            str(trial.number),
            combination.scenario,
            combination.goal + (", rotating" if combination.rotates else ""),
            f"{combination.plant} {combination.node_count}",
            f"{combination.stiffness_ratio:.2f}",
            f"{trial.error_mm:.2f}",
            f"{trial.shape_error_mm:.2f}",
            f"{trial.place_bound_mm:.2f}",
            "-" if clearance is None else f"{clearance:.1f}",
            stiffness if trial.told else f"({stiffness})",
            f"{trial.noise_ratio:.1f}",
        )
    console = Console()
    console.print(table)
    for name, value in summary(trials).items():
        console.print(f"{name}: {value:g}", markup=False)
    console.print(
        f"good: at most {MAX_ERROR:g} mm ({MAX_ERROR_ON_SUPPORT:g} mm with a support), nothing "
        f"touched, stiffness within {100 * MAX_STIFFNESS_ERROR:g} % where start and goal tell it"
    )
    commits = sorted({t.commit for t in trials})
    if len(commits) > 1:
        console.print(f"runs of {len(commits)} versions of the code: {', '.join(commits)}")
    for trial, combination in zip(trials, combinations, strict=True):
        if trial.faults:
            console.print(escape(f"{combination}: {', '.join(trial.faults)}; {trial.reason}"))
            console.print(f"  {_command(combination, scenario)}", soft_wrap=True)


def _command(combination: Combination, scenario: tuple[str, ...]) -> str:
    """Command that repeats one run."""
    chosen = f" --scenario {' '.join(scenario)}" if scenario else ""
    chosen += "" if combination.adapts else " --no-adapt"
    number = combination.number
    return f"lariat bench robustness --seed {combination.seed} --only {number}{chosen} --again"
