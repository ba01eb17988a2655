"""Closed-loop runs through published kinds of obstacle scenes: `lariat bench narrow`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.campaign import Campaign, Workers, success_interval
from benchmarks.narrow.scenes import FAMILIES, GAPS, Family, PlantModel
from benchmarks.narrow.trial import (
    MAX_SHAPE_ERROR,
    MAX_TIP_ANGLE,
    MAX_TIP_ERROR,
    WaySpec,
    WayTrial,
    run_trial,
)
from benchmarks.tables import Result, publish


def run(
    family: tuple[Family, ...] = FAMILIES,
    gap: tuple[float, ...] = GAPS,
    count: int = 2,
    first: int = 0,
    seed: int = 0,
    stiffness_error: tuple[float, ...] = (1.5, 1 / 1.5),
    plant: tuple[PlantModel, ...] = ("rod", "mujoco"),
    results: Path | None = None,
    workers: Workers = 1,
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Run seeded scenes with a hidden way in closed loop, with a finer plant than the model.

    The plant, Lariat's rod with three times the model's edges, has verified the hidden way of each
    scene; planner and controller are not told it. True nodes are sensed. The stiffness is wrong and
    adapted. Stiffnesses and plants alternate from scene to scene, and take turns with each other.

    Examples:
      lariat bench narrow --count 4 --workers 2 --results ways.jsonl
      lariat bench narrow --family posts windows --gap 2 3 --plant mujoco

    Args:
        family: Families of scenes.
        gap: Widths of the openings in rope diameters.
        count: Number of scenes of each family and width.
        first: Number of the first scene.
        seed: Seed of the scenes.
        stiffness_error: True stiffnesses relative to the controller's belief [-].
        plant: Simulators of the true rope.
        results: File of finished trials, one JSON object a line; trials that it holds are not run
            again.
        workers: Number of processes, or the address of a Dask scheduler.
        json: Print one JSON object instead of a table: `trials`, and the `summary`.
        output: Folder for the same as CSV.

    Returns:
        0 if all trials succeeded, else 1.
    """
    hidden = list(product(plant, stiffness_error))
    specs = [
        WaySpec(kind, width, number, seed, error, model)
        for order, (number, kind, width) in enumerate(
            product(range(first, first + count), family, gap), start=first * len(family) * len(gap)
        )
        for model, error in [hidden[(order + order // len(hidden)) % len(hidden)]]
    ]
    trials = Campaign(run_trial, WayTrial, _line).trials(specs, results, workers)
    groups = sorted({(t.spec.family, t.spec.gap) for t in trials})
    rows = [
        summary(*group, [t for t in trials if (t.spec.family, t.spec.gap) == group])
        for group in groups
    ]
    if trials:
        rows.append(summary("all", None, trials))
    conditions = (
        f"reached: tips within {MAX_TIP_ERROR:g} mm and {MAX_TIP_ANGLE:g} rad, shape within "
        f"{MAX_SHAPE_ERROR:g} mm, nothing touched; plant finer than the model; true nodes, "
        "adapting; errors of those that reached, median and worst; plan: processor time"
    )
    details = [Result("trials", trials)]
    publish([Result("summary", rows, conditions)], json, output, details)
    return 0 if trials and all(trial.reached for trial in trials) else 1


def _line(trial: WayTrial) -> str:
    spec = trial.spec
    plans = " + ".join(f"{s:.1f}" for s in trial.plan_cpu_s)
    return (
        f"{spec.family}-{spec.number}, {spec.gap:g} diameters, {spec.plant}, stiffness x "
        f"{spec.stiffness_error:.2f}: {'reached' if trial.reached else 'missed'}, tips "
        f"{trial.tip_error_mm:.1f} mm, {trial.tip_angle:.3f} rad, shape {trial.shape_error_mm:.2f} "
        f"mm off; {trial.min_clearance_mm:.1f} mm clear; plans {plans} s of processor time; "
        f"{trial.run_s:.1f} s, {trial.reason}"
    )


def summary(family: str, gap: float | None, trials: Sequence[WayTrial]) -> dict[str, object]:
    """Return the row of some trials."""
    good = [t for t in trials if t.reached]
    plans = [s for t in trials for s in t.plan_cpu_s] or [np.nan]
    tips, shapes = [t.tip_error_mm for t in good], [t.shape_error_mm for t in good]
    return {
        "family": family,
        "gap_diameters": gap,
        "trials": len(trials),
        "reached": len(good),
        "rate_95": list(success_interval(len(good), len(trials))),
        "gave_up": sum(t.gave_up for t in trials),
        "touched": sum(t.min_clearance_mm <= 0.0 for t in trials),
        "min_clearance_mm": min(t.min_clearance_mm for t in trials),
        "tip_error_mm": [float(np.median(tips)), max(tips)] if good else None,
        "shape_error_mm": [float(np.median(shapes)), max(shapes)] if good else None,
        "plan_p50_s": float(np.quantile(plans, 0.5)),
        "plan_p90_s": float(np.quantile(plans, 0.9)),
    }
