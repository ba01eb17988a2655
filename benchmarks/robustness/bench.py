"""Runs with hidden ropes, grips and simulators: `lariat bench robustness`.

Each combination is a shipped scenario with another simulator, resolution, stiffness and length of
the rope, held off the believed grips; it is seen by the camera, and the controller adapts. Its goal
is a rest shape of the true rope as truly held, at the scenario's grips or at seeded ones.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.campaign import CAMPAIGN_DEFAULTS, CampaignOptions, Trial
from benchmarks.robustness.combinations import Combination, sample
from benchmarks.robustness.observability import bounds
from benchmarks.robustness.scene import build_scene
from benchmarks.tables import Flat, Result
from lariat.configuration import ConfigurationError
from lariat.simulation.plants.factory import true_properties
from shared import topics
from shared.messages import FAILED
from shared.version import commit
from stack.simulation import closed_loop

TIME_AFTER_GOAL = 3.0
"""Time for which a run goes on after the controller says that the goal is reached [s]."""
MAX_ERROR, MAX_ERROR_ON_SUPPORT = 1.0, 2.0
"""Largest mean distance of true rope and goal at the end of a good run [mm], and the same where the
rope leans on a support, whose friction the model lacks."""
PLACE_DEVIATIONS = 2.0
"""Distance along the rope that nobody can see, in least standard deviations of the place [-]."""
MAX_STIFFNESS_ERROR = 0.1
"""Largest relative error of a good stiffness [-]."""
MAX_NOISE_RATIO = 2.0
"""Largest ratio of a horizon's prediction error and the noise that is counted as good [-]."""
OBSERVABLE_DEVIATION = 0.05
"""Least standard deviation that the shapes admit, up to which they determine the stiffness [-]."""
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
    options: Flat[CampaignOptions] = CAMPAIGN_DEFAULTS,
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

    Returns:
        0 if all combinations ran to their goals, touched nothing and found the stiffness where
        the shapes determine it, else 1; without adaptation, if all that missed their goals gave up.
    """
    numbers = only or range(first, first + count)
    combinations = [sample(seed, number, scenario, adapt) for number in numbers]
    kept = replace(options, results=options.results or folder / "trials.jsonl")
    trials = kept.trials(partial(run_trial, folder), combinations, again)
    if not trials:
        raise ConfigurationError("none of the combinations can be run; take another seed")
    judged = (
        f"good: at most {MAX_ERROR:g} mm ({MAX_ERROR_ON_SUPPORT:g} mm with a support) off, or the "
        "shape is, and its place along the rope no further than the shapes leave open; nothing "
        f"touched, stiffness within {100 * MAX_STIFFNESS_ERROR:g} % where start and goal determine "
        f"it; commits: {', '.join(sorted({t['commit'] for t in trials}))}"
    )
    options.publish(
        Result("table", [row(t) for t in trials], CONDITIONS),
        Result("summary", [{"measure": k, "value": v} for k, v in summary(trials).items()], judged),
        details=[Result("trials", trials)],
    )
    chosen = f" --scenario {' '.join(scenario)}" if scenario else ""
    for trial in (t for t in trials if faults(t)):
        again_by = f"--only {trial['spec'].number}{chosen}{'' if adapt else ' --no-adapt'} --again"
        missed = ", ".join(faults(trial))
        print(f"{trial['spec']}: {missed}; {trial['reason']}", file=sys.stderr)
        print(f"  lariat bench robustness --seed {seed} {again_by}", file=sys.stderr)
    return 1 if len(trials) < len(combinations) or any(map(faults, trials)) else 0


def run_trial(folder: Path, combination: Combination) -> Trial:
    """Run a combination, whose scenario and goal are kept below a folder.

    Stiffnesses are shares of the true one; bounds are least standard deviations that start and
    goal admit. What a run that did not start would tell is infinite or NaN.
    """
    adapts = "" if combination.adapts else "-no-adapt"
    name = f"{combination.seed}-{combination.number}{adapts}"
    try:
        scenario = build_scene(combination, folder / name)
    except ConfigurationError as error:
        raise ConfigurationError(f"{combination}: cannot be run: {error}") from None
    outcome = closed_loop.run(scenario, stop_after=TIME_AFTER_GOAL)
    score, ended = outcome.score, outcome.stack.latest(topics.TASK_STATE)
    properties, least = true_properties(scenario), bounds(scenario)
    true_stiffness = properties.bending_stiffness * float(np.mean(properties.stiffness_profile))
    value, deviation = score.parameters.get("bending_stiffness", (np.nan, np.nan))
    error, noise = score.horizon_error_mm, score.sensing_error_mm
    shape_error = score.final_shape_error_mm
    return {
        "commit": commit(),
        "error_mm": np.inf if score.final_error_mm is None else score.final_error_mm,
        "shape_error_mm": np.nan if shape_error is None else shape_error,
        "min_clearance_mm": score.min_clearance_mm,
        "touched": score.contact_time_s > 0.0,
        "gave_up": ended is not None and ended.state == FAILED,
        "leans": any(body.support for body in scenario.bodies),
        "stiffness": value / true_stiffness,
        "stiffness_deviation": deviation / true_stiffness,
        "stiffness_bound": least.stiffness,
        "place_bound_mm": 1e3 * least.place,
        "noise_ratio": error / noise if error is not None and noise else np.nan,
        "reason": outcome.reason,
    }


def nodes_are_near(trial: Trial) -> bool:
    """Return whether the rope's nodes ended at those of its goal."""
    return trial["error_mm"] <= _tolerance(trial)


def is_near(trial: Trial) -> bool:
    """Return whether the rope ended at its goal, as far as shapes tell its place along itself."""
    tolerance, unseen = _tolerance(trial), PLACE_DEVIATIONS * trial["place_bound_mm"]
    has_shape = trial["shape_error_mm"] <= tolerance
    return nodes_are_near(trial) or (
        has_shape and trial["error_mm"] <= float(np.hypot(tolerance, unseen))
    )


def _tolerance(trial: Trial) -> float:
    """Largest error [mm]."""
    return MAX_ERROR_ON_SUPPORT if trial["leans"] else MAX_ERROR


def is_observable(trial: Trial) -> bool:
    """Return whether the shapes determine the stiffness."""
    return trial["stiffness_bound"] <= OBSERVABLE_DEVIATION


def stiffness_is_good(trial: Trial) -> bool:
    """Return whether the estimated stiffness is near the true one."""
    return abs(trial["stiffness"] - 1.0) <= MAX_STIFFNESS_ERROR


def faults(trial: Trial) -> list[str]:
    """Return what keeps a run from being good, in words."""
    found = []
    adapts = trial["spec"].adapts
    # Without adaptation a run may fail, as long as it says so.
    if not is_near(trial) and (adapts or not trial["gave_up"]):
        found.append(f"{trial['error_mm']:.2f} mm off")
    if trial["touched"]:
        found.append("touched")
    if adapts and is_observable(trial) and not stiffness_is_good(trial):
        found.append(f"stiffness {trial['stiffness']:.2f} of the true one")
    return found


def summary(trials: Sequence[Trial]) -> dict[str, float]:
    """Return counts and statistics of several runs."""
    errors, shapes, noises = (
        [t[name] for t in trials] for name in ("error_mm", "shape_error_mm", "noise_ratio")
    )
    observable = [t for t in trials if is_observable(t)]
    clearances = [t["min_clearance_mm"] for t in trials if t["min_clearance_mm"] is not None]
    return {
        "runs": len(trials),
        "good": sum(not faults(t) for t in trials),
        "at the goal": sum(map(is_near, trials)),
        "nodes at the goal": sum(map(nodes_are_near, trials)),
        "gave up": sum(t["gave_up"] for t in trials),
        "touched": sum(t["touched"] for t in trials),
        "median error [mm]": float(np.median(errors)),
        "90 % of the errors below [mm]": float(np.quantile(errors, 0.9, method="higher")),
        "median error of the shape [mm]": float(np.nanmedian(shapes)),
        "shape within 1 mm": sum(error <= MAX_ERROR for error in shapes),
        "least clearance [mm]": min(clearances, default=np.nan),
        "stiffness is observable": len(observable),
        "stiffness within 10 % there": sum(map(stiffness_is_good, observable)),
        "horizon error within twice the noise": sum(r <= MAX_NOISE_RATIO for r in noises),
        "median horizon error / noise": float(np.nanmedian(noises)),
    }


def row(trial: Trial) -> dict[str, object]:
    """Return the row of a run: its conditions, its figures, and what it missed."""
    spec = trial["spec"]
    clearance = trial["min_clearance_mm"]
    stiffness = f"{trial['stiffness']:.2f} ± {trial['stiffness_deviation']:.2f}"
    return {
        "no.": spec.number,
        "scenario": spec.scenario,
        "goal": spec.goal + (", rotating" if spec.rotates else ""),
        "plant, n": f"{spec.plant}, {spec.node_count}",
        "EI ×": f"{spec.stiffness_ratio:.2f}",
        "length": f"{100.0 * (spec.length_ratio - 1.0):+.0f} %",
        "error [mm]": f"{trial['error_mm']:.2f}",
        "of the shape [mm]": f"{trial['shape_error_mm']:.2f}",
        "place known to [mm]": f"{trial['place_bound_mm']:.2f}",
        "clearance [mm]": None if clearance is None else f"{clearance:.1f}",
        "EI found / true": stiffness if is_observable(trial) else f"({stiffness})",
        "horizon error / noise": f"{trial['noise_ratio']:.1f}",
        "missed": "; ".join(faults(trial)),
    }
