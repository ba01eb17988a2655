"""Closed-loop runs to random goals in random scenes: `lariat bench goals`.

Every goal is a rest shape of the true rope. Rope, cylinders and limits are those of
`scenarios/three-cylinders.toml` unless the kind of scene says otherwise
(`environments.scenes`); all services run as in `lariat run`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np

from benchmarks.campaign import CAMPAIGN_DEFAULTS, CampaignOptions, Trial, groups
from benchmarks.conditions import Conditions
from benchmarks.goals.clearance import calibrate
from benchmarks.goals.motion_metrics import MotionMetrics
from benchmarks.tables import Flat, Result
from environments.scenes import Kind, sample_scene
from lariat.configuration import ConfigurationError
from lariat.scenario import load
from lariat.scenario.settings import load_with
from shared.messages import FAILED
from stack.simulation import closed_loop

BASE_SCENARIO = Path("three-cylinders")
"""Scenario of rope, cylinders and limits."""
PLANNING_STEP_MS = 20.0
"""Duration of the planner's step above which it counts as a planning [ms]."""


@dataclass(frozen=True)
class GoalSpec:
    """Scene by its kind, number and seed, and the setting under comparison."""

    kind: Kind
    number: int
    seed: int
    settings: tuple[str, ...] = ()
    """Changes of the base scenario, as of `lariat run --set`."""
    variant: str = ""
    """Setting under comparison, in words."""


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
    clearance: int = 0,
    options: Flat[CampaignOptions] = CAMPAIGN_DEFAULTS,
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
      lariat bench goals --scene arms --sensing camera --plant mujoco --time-limit 15
      lariat bench goals --scene hard boxes rotating slot --count 250 --clearance 4

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
        clearance: Number of ropes, drawn from what is stated of them, that are driven open loop
            along the path of each scene, in place of a run: how many come closer than the clearance
            that it keeps with 99 %. Other options than scene, count, first and seed do not matter.

    Returns:
        0 if all trials succeeded, or the rate is at most 2 % with 95 %, else 1.

    Raises:
        ConfigurationError: A setting is refused, or perception is compared without a camera.
    """
    if clearance:
        return calibrate(scene, range(first, first + count), seed, clearance, options)
    if perception != ("ridge",) and sensing != "camera":
        raise ConfigurationError(
            f"--perception {' '.join(perception)} needs images; add --sensing camera"
        )
    base = load(BASE_SCENARIO)
    choices = {
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
    for values in product(*choices.values()):
        kind, controls, plans, estimates, perceives, model, factor, latency_ms, adapts = values
        path_planner = base.control.path_planner if plans == "none" else plans
        settings = (
            f"rope.youngs_modulus={youngs_modulus!r}",
            f"sensing.source={sensing}",
            f"sensing.node_noise={1e-3 * noise!r}",
            f"run.time_limit={time_limit!r}",
            f"plant.model={model}",
            f"plant.rope.youngs_modulus={youngs_modulus * factor!r}",
            f"sensing.method={perceives}",
            f"sensing.latency={1e-3 * latency_ms!r}",
            f"control.method={controls}",
            f"control.planner={str(plans != 'none').lower()}",
            f"control.path_planner={path_planner}",
            f"control.state_estimator={estimates}",
            f"control.adapt={str(adapts).lower()}",
        )
        # Refuses unknown methods and values out of bounds before anything runs.
        load_with(BASE_SCENARIO, settings)
        variant = ", ".join(
            f"{name} {value}" if name in ("stiffness x", "latency", "adapt") else f"{value}"
            for (name, several), value in zip(choices.items(), values, strict=True)
            if len(several) > 1
        )
        specs += [
            GoalSpec(kind, number, seed, settings, variant or kind)
            for number in range(first, first + count)
        ]
    trials = options.trials(run_trial, specs)
    columns = {
        name: {**group[0]["conditions"], **summary(group)}
        for (name,), group in groups(trials, "variant").items()
    }
    rows: list[dict[str, Any]] = [
        {"measure": measure, **{name: column[measure] for name, column in columns.items()}}
        for measure in (next(iter(columns.values())) if columns else ())
    ]
    meaning = "error: mean node distance of true rope and goal, last 0.2 s of a run"
    options.publish(Result("summary", rows, meaning), details=[Result("trials", trials)])
    return 0 if trials and all(t["succeeded"] for t in trials) else 1


def run_trial(spec: GoalSpec) -> Trial:
    """Sample the scene and run it.

    It succeeds where nothing is touched and the goal is reached, or given up where it is blocked.
    """
    base = load_with(BASE_SCENARIO, spec.settings)
    scenario = sample_scene(spec.kind, spec.number, spec.seed, base)
    metrics = MotionMetrics(scenario)
    outcome = closed_loop.run(scenario, taps=(metrics,))
    gave_up = metrics.task is not None and metrics.task.state == FAILED
    ended = gave_up if spec.kind == "blocked" else outcome.score.reached
    return {
        "conditions": asdict(Conditions.of(scenario)),
        "score": asdict(outcome.score),
        "reason": outcome.reason,
        "gave_up": gave_up,
        "plan_s": [ms / 1e3 for ms in outcome.stack.step_ms("planner") if ms > PLANNING_STEP_MS],
        "speed": metrics.speed,
        "acceleration": metrics.acceleration,
        "grip_distance": metrics.grip_distance,
        "gripper_clearance_mm": 1e3 * metrics.gripper_clearance,
        "longest_stop": metrics.longest_stop,
        "succeeded": ended and outcome.score.contact_time_s == 0.0,
    }


def summary(trials: Sequence[Trial]) -> dict[str, float]:
    """Return statistics of several trials; the error of a rope that never moved is infinite."""

    def of(name: str) -> list[float]:
        values = [t["score"].get(name, t.get(name)) for t in trials]
        return [value for value in values if value is not None]

    errors = [np.inf if (e := t["score"]["final_error_mm"]) is None else e for t in trials]
    plans = [s for t in trials for s in t["plan_s"]] or [np.nan]
    figures = {
        "trials": len(trials),
        "succeeded": sum(t["succeeded"] for t in trials),
        **{f"error below {bound} mm": sum(e < bound for e in errors) for bound in (1, 3, 5)},
        "touched": sum(seconds > 0.0 for seconds in of("contact_time_s")),
        "median error [mm]": np.median(errors),
        "largest error [mm]": np.max(errors),
        "least clearance [mm]": min(of("min_clearance_mm"), default=np.nan),
        "least gripper clearance [mm]": min(of("gripper_clearance_mm")),
        "largest length error [mm]": max(of("length_error_mm")),
        "median time to goal [s]": np.median(of("reached_s") or [np.nan]),
        "largest speed [of limit]": max(of("speed")),
        "largest acceleration [of limit]": max(of("acceleration")),
        "largest grip distance [of length]": max(of("grip_distance")),
        "longest stop on the way [s]": max(of("longest_stop")),
        "median horizon error [mm]": np.median(of("horizon_error_mm") or [np.nan]),
        "median planning time [s]": np.median(plans),
        "longest planning time [s]": np.max(plans),
        "controller step p50 [ms]": np.median([t["score"]["plan_ms"]["p50"] for t in trials]),
        "controller step p99 [ms]": np.median([t["score"]["plan_ms"]["p99"] for t in trials]),
        "replans": sum(of("replans")),
    }
    return {name: round(float(value), 4) for name, value in figures.items()}
