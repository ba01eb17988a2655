"""Closed-loop runs through published kinds of obstacle scenes: `lariat bench narrow`."""

from __future__ import annotations

import json as encoder
from collections.abc import Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path

import numpy as np
from rich.markup import escape
from rich.table import Table

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
from benchmarks.result_block import find_block, show


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
    docs: Path | None = None,
    json: bool = False,
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
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.

    Returns:
        0 if all trials succeeded, else 1.
    """
    block = find_block(docs)
    hidden = list(product(plant, stiffness_error))
    specs = [
        WaySpec(kind, width, number, seed, error, model)
        for order, (number, kind, width) in enumerate(
            product(range(first, first + count), family, gap), start=first * len(family) * len(gap)
        )
        for model, error in [hidden[(order + order // len(hidden)) % len(hidden)]]
    ]
    trials = Campaign(run_trial, WayTrial, _line).trials(specs, results, workers)
    if json:
        print(encoder.dumps({"trials": [asdict(trial) for trial in trials]}))
    else:
        show([_table(trials)], block)
    return 0 if trials and not any(trial.misses for trial in trials) else 1


def _line(trial: WayTrial) -> str:
    spec = trial.spec
    verdict = ", ".join(trial.misses) or f"reached, shape {trial.shape_error_mm:.2f} mm off"
    plans = " + ".join(f"{s:.1f}" for s in trial.plan_s)
    return (
        f"{spec.family}-{spec.number}, {spec.gap:g} diameters, {spec.plant}, stiffness x "
        f"{spec.stiffness_error:.2f}: {verdict}; {trial.clearance_mm:.1f} mm clear; plans {plans} "
        f"s of processor time; {trial.run_s:.1f} s, {trial.reason}"
    )


def _table(trials: Sequence[WayTrial]) -> Table:
    table = Table(
        caption=f"success: tips within {MAX_TIP_ERROR:g} mm and {MAX_TIP_ANGLE:g} rad, shape "
        f"within {MAX_SHAPE_ERROR:g} mm, nothing touched; plant finer than the model; true nodes, "
        "adapting; plan: processor time"
    )
    for name in (
        "family",
        "gap [diameters]",
        "succeeded",
        "95 % interval",
        "touched",
        "least clearance [mm]",
        "tip error median / worst [mm]",
        "shape error median / worst [mm]",
        "plan p50 / p90 [s]",
    ):
        table.add_column(escape(name), justify="right")
    for kind, width in sorted({(t.spec.family, t.spec.gap) for t in trials}):
        rows = [t for t in trials if (t.spec.family, t.spec.gap) == (kind, width)]
        _add_row(table, kind, f"{width:g}", rows)
    table.add_section()
    _add_row(table, "all", "", trials)
    return table


def _add_row(table: Table, family: str, gap: str, trials: Sequence[WayTrial]) -> None:
    if not trials:
        return
    good = [t for t in trials if not t.misses]
    plans = [s for t in trials for s in t.plan_s] or [np.nan]
    low, high = success_interval(len(good), len(trials))
    table.add_row(
        family,
        gap,
        f"{len(good)} / {len(trials)}",
        f"{100.0 * low:.0f} to {100.0 * high:.0f} %",
        str(sum(t.clearance_mm <= 0.0 for t in trials)),
        f"{min(t.clearance_mm for t in trials):.1f}",
        _spread([t.tip_error_mm for t in good]),
        _spread([t.shape_error_mm for t in good]),
        f"{np.quantile(plans, 0.5):.1f} / {np.quantile(plans, 0.9):.1f}",
    )


def _spread(values: list[float]) -> str:
    return f"{np.median(values):.2f} / {max(values):.2f}" if values else "-"
