"""Runs with hidden ropes, grips and simulators: `lariat bench robustness`.

Each combination is a shipped scenario with another simulator, resolution, stiffness and length of
the rope, held off the believed grips; it is seen by the camera, and the controller adapts. Its goal
is a rest shape of the true rope as truly held, at the scenario's grips or at seeded ones.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.campaign import Campaign, Workers
from benchmarks.paper.horizon import MAX_NOISE_RATIO
from benchmarks.robustness.combinations import sample
from benchmarks.robustness.trial import (
    MAX_ERROR,
    MAX_ERROR_ON_SUPPORT,
    MAX_STIFFNESS_ERROR,
    Trial,
    run_trial,
)
from benchmarks.tables import Result, publish
from lariat.configuration import ConfigurationError

CONDITIONS = (
    "camera; error: mean node distance of true rope and goal, last 0.2 s; shape: mean distance of "
    "their curves; place: least standard deviation of the nodes along the rope that the shapes "
    "admit; EI found: share of the true stiffness ± stated standard deviation, in brackets where "
    "start and goal do not determine it; horizon: its prediction error in units of the noise"
)


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
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Run combinations of hidden ropes, grips and simulators in closed loop.

    Finished runs are kept in FOLDER/trials.jsonl and are not run again, so that an interrupted
    campaign goes on where it was. FOLDER/SEED-NUMBER holds scenario and goal of each, for
    `lariat run FOLDER/SEED-NUMBER/scenario.toml`.

    Examples:
      lariat bench robustness --workers 2 --output docs/results/robustness
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
        json: Print one JSON object instead of tables.
        output: Folder for the tables as CSV.

    Returns:
        0 if all combinations ran to their goals, touched nothing and found the stiffness where
        the shapes determine it, else 1; without adaptation, if all that missed their goals gave up.
    """
    numbers = only or range(first, first + count)
    combinations = [sample(seed, number, scenario, adapt) for number in numbers]
    campaign = Campaign(partial(run_trial, folder), Trial, _line)
    trials = campaign.trials(combinations, folder / "trials.jsonl", workers, again)
    if not trials:
        raise ConfigurationError("none of the combinations can be run; take another seed")
    judged = (
        f"good: at most {MAX_ERROR:g} mm ({MAX_ERROR_ON_SUPPORT:g} mm with a support), nothing "
        f"touched, stiffness within {100 * MAX_STIFFNESS_ERROR:g} % where start and goal determine "
        f"it; commits: {', '.join(sorted({t.commit for t in trials}))}"
    )
    tables = [
        Result("table", [row(t) for t in trials], CONDITIONS),
        Result("summary", [{"measure": k, "value": v} for k, v in summary(trials).items()], judged),
    ]
    publish(tables, json, output, [Result("trials", trials)])
    chosen = f" --scenario {' '.join(scenario)}" if scenario else ""
    for trial in (t for t in trials if t.faults):
        again_by = f"--only {trial.spec.number}{chosen}{'' if adapt else ' --no-adapt'} --again"
        print(f"{_line(trial)}; {trial.reason}", file=sys.stderr)
        print(f"  lariat bench robustness --seed {seed} {again_by}", file=sys.stderr)
    return 1 if len(trials) < len(combinations) or any(t.faults for t in trials) else 0


def _line(trial: Trial) -> str:
    return f"{trial.spec}: {', '.join(trial.faults) or 'good'}"


def summary(trials: Sequence[Trial]) -> dict[str, float]:
    """Return counts and statistics of several runs."""
    errors = [t.error_mm for t in trials]
    observable = [t for t in trials if t.observable]
    clearances = [t.min_clearance_mm for t in trials if t.min_clearance_mm is not None]
    return {
        "runs": len(trials),
        "good": sum(not t.faults for t in trials),
        "at the goal": sum(t.near for t in trials),
        "gave up": sum(t.gave_up for t in trials),
        "touched": sum(t.touched for t in trials),
        "median error [mm]": float(np.median(errors)),
        "90 % of the errors below [mm]": float(np.quantile(errors, 0.9, method="higher")),
        "median error of the shape [mm]": float(np.nanmedian([t.shape_error_mm for t in trials])),
        "shape within 1 mm": sum(t.shape_error_mm <= MAX_ERROR for t in trials),
        "least clearance [mm]": min(clearances, default=np.nan),
        "stiffness is observable": len(observable),
        "stiffness within 10 % there": sum(t.stiffness_is_good for t in observable),
        "horizon error within twice the noise": sum(
            t.noise_ratio <= MAX_NOISE_RATIO for t in trials
        ),
        "median horizon error / noise": float(np.nanmedian([t.noise_ratio for t in trials])),
    }


def row(trial: Trial) -> dict[str, object]:
    """Return the row of a run: its conditions, its figures, and what it missed."""
    spec = trial.spec
    clearance = trial.min_clearance_mm
    stiffness = f"{trial.stiffness:.2f} ± {trial.stiffness_deviation:.2f}"
    return {
        "no.": spec.number,
        "scenario": spec.scenario,
        "goal": spec.goal + (", rotating" if spec.rotates else ""),
        "plant, n": f"{spec.plant}, {spec.node_count}",
        "EI ×": f"{spec.stiffness_ratio:.2f}",
        "length": f"{100.0 * (spec.length_ratio - 1.0):+.0f} %",
        "error [mm]": f"{trial.error_mm:.2f}",
        "of the shape [mm]": f"{trial.shape_error_mm:.2f}",
        "place known to [mm]": f"{trial.place_bound_mm:.2f}",
        "clearance [mm]": None if clearance is None else f"{clearance:.1f}",
        "EI found / true": stiffness if trial.observable else f"({stiffness})",
        "horizon error / noise": f"{trial.noise_ratio:.1f}",
        "missed": "; ".join(trial.faults),
    }
