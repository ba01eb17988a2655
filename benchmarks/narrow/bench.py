"""Closed-loop runs through published kinds of obstacle scenes: `lariat bench narrow`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from benchmarks.campaign import (
    CAMPAIGN_DEFAULTS,
    CampaignOptions,
    Trial,
    groups,
    success_interval,
)
from benchmarks.narrow.scenes import FAMILIES, GAPS, Family, PlantModel
from benchmarks.narrow.trial import (
    MAX_SHAPE_ERROR,
    MAX_TIP_ANGLE,
    MAX_TIP_ERROR,
    WaySpec,
    run_trial,
)
from benchmarks.tables import Flat, Result


def run(
    family: tuple[Family, ...] = FAMILIES,
    gap: tuple[float, ...] = GAPS,
    count: int = 2,
    first: int = 0,
    seed: int = 0,
    stiffness_error: tuple[float, ...] = (1.5, 1 / 1.5),
    plant: tuple[PlantModel, ...] = ("rod", "mujoco"),
    options: Flat[CampaignOptions] = CAMPAIGN_DEFAULTS,
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
    trials = options.trials(run_trial, specs)
    by_scene = groups(trials, "family", "gap")
    rows = [_summary(*key, by_scene[key]) for key in sorted(by_scene)]
    if trials:
        rows.append(_summary("all", None, trials))
    conditions = (
        f"reached: tips within {MAX_TIP_ERROR:g} mm and {MAX_TIP_ANGLE:g} rad, shape within "
        f"{MAX_SHAPE_ERROR:g} mm, nothing touched; plant finer than the model; true nodes, "
        "adapting; errors of those that reached, median and worst; plan: processor time"
    )
    options.publish(Result("summary", rows, conditions), details=[Result("trials", trials)])
    return 0 if trials and all(trial["reached"] for trial in trials) else 1


def _summary(family: str, gap: float | None, trials: Sequence[Trial]) -> dict[str, object]:
    """Return the row of some trials."""
    good = [t for t in trials if t["reached"]]
    plans = [s for t in trials for s in t["plan_cpu_s"]] or [np.nan]
    clearances = [t["min_clearance_mm"] for t in trials]

    def median_and_worst(name: str) -> list[float] | None:
        values = [t[name] for t in good]
        return [float(np.median(values)), max(values)] if values else None

    return {
        "family": family,
        "gap_diameters": gap,
        "trials": len(trials),
        "reached": len(good),
        "rate_95": list(success_interval(len(good), len(trials))),
        "gave_up": sum(t["gave_up"] for t in trials),
        "touched": sum(clearance <= 0.0 for clearance in clearances),
        "min_clearance_mm": min(clearances),
        "tip_error_mm": median_and_worst("tip_error_mm"),
        "shape_error_mm": median_and_worst("shape_error_mm"),
        "plan_p50_s": float(np.quantile(plans, 0.5)),
        "plan_p90_s": float(np.quantile(plans, 0.9)),
    }
