"""Closed-loop runs to random goals in random scenes: `lariat bench goals`.

Every goal is a rest shape of the true rope. Rope, cylinders and limits are those of
`scenarios/three-cylinders.toml` unless the kind of scene says otherwise
(`environments.scenes`); all services run as in `lariat run`.
"""

from __future__ import annotations

import json as encoder
from dataclasses import asdict, replace
from itertools import groupby, product
from pathlib import Path
from typing import Literal

from rich.markup import escape
from rich.table import Table

from benchmarks.campaign import Campaign, Workers
from benchmarks.goals import campaign
from benchmarks.goals.campaign import Trial, TrialSpec, run_trial
from benchmarks.result_block import find_block, show
from environments.scenes import Kind
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, load
from lariat.scenario.sections import (
    CONTROL_METHODS,
    PATH_PLANNERS,
    PERCEPTION_METHODS,
    STATE_ESTIMATORS,
)
from lariat.scenario.shipped import find

BASE_SCENARIO = "three-cylinders"
"""Scenario of rope, cylinders and limits."""
NO_PLANNER = "none"
"""Value of `--planner` with which no path is planned."""


def run(
    scene: tuple[Kind, ...] = ("hard",),
    count: int = 10,
    first: int = 0,
    seed: int = 0,
    method: tuple[str, ...] = ("gauss_newton",),
    planner: tuple[str, ...] = ("whole_path",),
    estimator: tuple[str, ...] = ("rod",),
    perception: tuple[str, ...] = ("ridge",),
    plant: tuple[Literal["rod", "mujoco", "links"], ...] = ("rod",),
    stiffness_error: tuple[float, ...] = (1.0,),
    youngs_modulus: float = 1.0e6,
    noise: float = 0.0,
    latency: tuple[float, ...] = (20.0,),
    sensing: Literal["truth", "camera"] = "truth",
    adapt: tuple[bool, ...] = (False,),
    time_limit: float = 8.0,
    workers: Workers = 1,
    docs: Path | None = None,
    json: bool = False,
    plots: Path | None = None,
) -> int:
    """Run random scenes in closed loop and print error, clearance, time and success.

    An option that takes several values compares them on the same scenes, one column each.

    Examples:
      lariat bench goals --count 100 --workers 2
      lariat bench goals --scene boxes slot --plots pictures
      lariat bench goals --stiffness-error 0.5 1.5 6 --noise 2 --adapt True False
      lariat bench goals --latency 20 30 60 100
      lariat bench goals --scene easy --method gauss_newton mypackage.control:Mine --planner none
      lariat bench goals --sensing camera --perception ridge mypackage.vision:Mine

    Args:
        scene: Kinds of scenes.
        count: Number of trials of each kind and setting.
        first: Number of the first trial.
        seed: Seed of the scenes.
        method: Controller: gauss_newton, network, actions, or an own class.
        planner: Planner of whole paths: whole_path, an own class, or none.
        estimator: State estimator: rod, or an own class.
        perception: Method that finds the rope in images: ridge, paper, or an own class; compared
            with --sensing camera. Own classes are given as package.module:Class.
        plant: Simulator of the true rope.
        stiffness_error: True stiffness relative to the controller's belief [-].
        youngs_modulus: Young's modulus that the controller believes [Pa].
        noise: Standard deviation of every perceived node if the truth is sensed [mm].
        latency: Time from exposure to image [ms].
        sensing: Source of the perceived rope.
        adapt: Whether the controller adapts the rope's parameters.
        time_limit: Duration of each run [s].
        workers: Number of processes, or the address of a Dask scheduler.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.
        plots: Folder for plots: a summary, and one of every failure.

    Returns:
        0 if all trials succeeded, else 1.

    Raises:
        ConfigurationError: A method is unknown, or perception is compared without a camera.
    """
    _check_names(method, planner, estimator, perception, sensing)
    block = find_block(docs)
    common = _common_scenario(youngs_modulus, noise, sensing, time_limit)
    options = {
        "scene": scene,
        "method": method,
        "planner": planner,
        "estimator": estimator,
        "perception": perception,
        "plant": plant,
        "stiffness x": stiffness_error,
        "latency": latency,
        "adapt": adapt,
    }
    specs = []
    for values in product(*options.values()):
        kind, controls, plans, estimates, perceives, model, factor, latency_ms, adapts = values
        true_rope = replace(common.plant.rope, youngs_modulus=youngs_modulus * factor)
        base = replace(
            common,
            plant=replace(common.plant, model=model, rope=true_rope),
            sensing=replace(common.sensing, method=perceives, latency=1e-3 * latency_ms),
            control=replace(
                common.control,
                method=controls,
                planner=plans != NO_PLANNER,
                path_planner="whole_path" if plans == NO_PLANNER else plans,
                state_estimator=estimates,
                adapt=adapts,
            ),
        )
        compared = zip(options.items(), values, strict=True)
        variant = ", ".join(
            f"{k} {v}" if k in ("stiffness x", "latency", "adapt") else f"{v}"
            for (k, choices), v in compared
            if len(choices) > 1
        )
        variant = variant or kind
        specs += [TrialSpec(kind, k, seed, base, variant) for k in range(first, first + count)]
    trials = Campaign(run_trial, Trial, _line).trials(specs, workers=workers)
    groups = {name: list(group) for name, group in groupby(trials, key=lambda t: t.variant)}
    if plots:
        _plot(groups, plots)
    if json:
        summaries = {
            name: {**asdict(group[0].conditions), **campaign.summary(group)}
            for name, group in groups.items()
        }
        print(encoder.dumps({"summary": summaries, "trials": [t.as_json() for t in trials]}))
    else:
        show([_table(groups)], block)
    return 0 if all(t.succeeded for t in trials) else 1


def _check_names(
    method: tuple[str, ...],
    planner: tuple[str, ...],
    estimator: tuple[str, ...],
    perception: tuple[str, ...],
    sensing: str,
) -> None:
    """Check the names of methods.

    Raises:
        ConfigurationError: A method is unknown, or perception is compared without a camera.
    """
    planners = [name for name in planner if name != NO_PLANNER]
    for option, names, known in (
        ("--method", method, CONTROL_METHODS),
        ("--planner", planners, PATH_PLANNERS),
        ("--estimator", estimator, STATE_ESTIMATORS),
        ("--perception", perception, PERCEPTION_METHODS),
    ):
        for name in names:
            known.check(name, option)
    if perception != ("ridge",) and sensing != "camera":
        raise ConfigurationError(
            f"--perception {' '.join(perception)} needs images; add --sensing camera"
        )


def _common_scenario(
    youngs_modulus: float,
    noise: float,
    sensing: Literal["truth", "camera"],
    time_limit: float,
) -> Scenario:
    base = load(find(BASE_SCENARIO))
    return replace(
        base,
        rope=replace(base.rope, youngs_modulus=youngs_modulus),
        sensing=replace(base.sensing, source=sensing, node_noise=1e-3 * noise),
        run=replace(base.run, time_limit=time_limit),
    )


def _line(trial: Trial) -> str:
    score = trial.score
    verdict = "succeeded" if trial.succeeded else "failed"
    return (
        f"{trial.kind}-{trial.number} ({trial.variant}) {verdict}: "
        f"error {score.final_error_mm} mm, "
        f"clearance {score.min_clearance_mm} mm, contact {score.contact_time_s} s, "
        f"replans {score.replans}; {trial.reason}"
    )


def _table(groups: dict[str, list[Trial]]) -> Table:
    table = Table(caption="error: mean node distance of true rope and goal, last 0.2 s of a run")
    table.add_column("")
    for name in groups:
        table.add_column(escape(name), justify="right")
    conditions = [asdict(group[0].conditions) for group in groups.values()]
    for name in conditions[0]:
        table.add_row(name, *(escape(column[name]) for column in conditions))
    table.add_section()
    summaries = [campaign.summary(group) for group in groups.values()]
    for name in summaries[0]:
        table.add_row(escape(name), *(f"{column[name]:g}" for column in summaries))
    return table


def _plot(groups: dict[str, list[Trial]], folder: Path) -> None:
    from benchmarks.goals import plots

    folder.mkdir(parents=True, exist_ok=True)
    plots.plot_summary(dict(groups), folder / "summary.png")
    for group in groups.values():
        for trial in group:
            if not trial.succeeded:
                setting = trial.variant.replace(" ", "-").replace(",", "")
                plots.plot_trial(trial, folder / f"{trial.kind}-{trial.number}-{setting}.png")
