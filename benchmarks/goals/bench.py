"""Closed-loop runs to random goals in random scenes: `lariat bench goals`.

Every goal is a rest shape of the true rope. Rope, cylinders and limits are those of
`scenarios/three-cylinders.toml` unless the kind of scene says otherwise
(`environments.scenes`); all services run as in `lariat run`.
"""

from __future__ import annotations

from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any, Literal

from benchmarks.campaign import Campaign, Workers
from benchmarks.goals.trial import BASE_SCENARIO, Trial, TrialSpec, restore, run_trial, summary
from benchmarks.tables import Result, publish
from environments.scenes import Kind
from lariat.configuration import ConfigurationError
from lariat.scenario import load
from lariat.scenario.settings import load_with

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
    results: Path | None = None,
    workers: Workers = 1,
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Run random scenes in closed loop and print error, clearance, time and success.

    An option that takes several values compares them on the same scenes, one column each.

    Examples:
      lariat bench goals --count 100 --workers 2
      lariat bench goals --scene boxes slot --results goals.jsonl
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
        results: File of finished trials, one JSON object a line; trials that it holds are not run
            again.
        workers: Number of processes, or the address of a Dask scheduler.
        json: Print one JSON object instead of a table: `trials`, and the `summary`.
        output: Folder for the same as CSV.

    Returns:
        0 if all trials succeeded, else 1.

    Raises:
        ConfigurationError: A setting is refused, or perception is compared without a camera.
    """
    if perception != ("ridge",) and sensing != "camera":
        raise ConfigurationError(
            f"--perception {' '.join(perception)} needs images; add --sensing camera"
        )
    base = load(BASE_SCENARIO)
    common = (
        f"rope.youngs_modulus={youngs_modulus!r}",
        f"sensing.source={sensing}",
        f"sensing.node_noise={1e-3 * noise!r}",
        f"run.time_limit={time_limit!r}",
    )
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
        path_planner = base.control.path_planner if plans == NO_PLANNER else plans
        settings = (
            *common,
            f"plant.model={model}",
            f"plant.rope.youngs_modulus={youngs_modulus * factor!r}",
            f"sensing.method={perceives}",
            f"sensing.latency={1e-3 * latency_ms!r}",
            f"control.method={controls}",
            f"control.planner={str(plans != NO_PLANNER).lower()}",
            f"control.path_planner={path_planner}",
            f"control.state_estimator={estimates}",
            f"control.adapt={str(adapts).lower()}",
        )
        # Refuses unknown methods and values out of bounds before anything runs.
        load_with(BASE_SCENARIO, settings)
        compared = zip(options.items(), values, strict=True)
        variant = ", ".join(
            f"{k} {v}" if k in ("stiffness x", "latency", "adapt") else f"{v}"
            for (k, choices), v in compared
            if len(choices) > 1
        )
        variant = variant or kind
        specs += [TrialSpec(kind, k, seed, settings, variant) for k in range(first, first + count)]
    trials = Campaign(run_trial, restore, _line).trials(specs, results, workers)
    groups = {spec.variant: [t for t in trials if t.spec.variant == spec.variant] for spec in specs}
    columns = {
        name: {**asdict(group[0].conditions), **summary(group)}
        for name, group in groups.items()
        if group
    }
    rows: list[dict[str, Any]] = [
        {"measure": measure, **{name: column[measure] for name, column in columns.items()}}
        for measure in (next(iter(columns.values())) if columns else ())
    ]
    meaning = "error: mean node distance of true rope and goal, last 0.2 s of a run"
    details = [{**asdict(t), "succeeded": t.succeeded} for t in trials]
    publish([Result("summary", rows, meaning)], json, output, [Result("trials", details)])
    return 0 if trials and all(t.succeeded for t in trials) else 1


def _line(trial: Trial) -> str:
    score = trial.score
    verdict = "succeeded" if trial.succeeded else "failed"
    return (
        f"{trial.spec.kind}-{trial.spec.number} ({trial.spec.variant}) {verdict}: "
        f"error {score.final_error_mm} mm, "
        f"clearance {score.min_clearance_mm} mm, contact {score.contact_time_s} s, "
        f"replans {score.replans}; {trial.reason}"
    )
