"""Plans through published kinds of obstacle scenes: `lariat bench ways`."""

from __future__ import annotations

import json as encoder
from collections.abc import Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.ways.scenes import FAMILIES, GAPS, Family
from benchmarks.ways.trial import WayTrial, run_trial
from services.planner.service import PlannerService
from shared.scenario import load
from shared.scenario.shipped import find

WARM_UP_SCENARIO = "three-cylinders"
"""Scenario whose plan compiles the kernels before anything is timed."""


def run(
    family: tuple[Family, ...] = FAMILIES,
    gap: tuple[float, ...] = GAPS,
    count: int = 2,
    first: int = 0,
    seed: int = 0,
    stiffness_error: tuple[float, ...] = (1.0,),
    results: Path | None = None,
    json: bool = False,
) -> int:
    """Plan in seeded scenes with a hidden way, and drive a finer plant along each path.

    The plant, Lariat's rod with three times the model's edges, has verified the hidden way. It is
    driven open loop along the planned path, without control.

    Examples:
      lariat bench ways --count 5
      lariat bench ways --family posts windows --gap 2 3 --results ways.jsonl

    Args:
        family: Families of scenes.
        gap: Widths of the openings in rope diameters.
        count: Number of scenes of each family and width.
        first: Number of the first scene.
        seed: Seed of the scenes.
        stiffness_error: True stiffness relative to the planner's belief [-].
        results: File of finished trials, one JSON object a line; trials that it holds are not run
            again.
        json: Print one JSON object instead of a table.

    Returns:
        0 if all trials succeeded, else 1.
    """
    PlannerService(load(find(WARM_UP_SCENARIO))).warm_up()
    known = _read(results)
    trials, console = [], Console(stderr=True, highlight=False)
    for kind, width, error, number in product(
        family, gap, stiffness_error, range(first, first + count)
    ):
        key = (kind, number, width, error)
        if key in known:
            trials.append(known[key])
            continue
        try:
            trial = run_trial(kind, number, seed, width, error)
        except ValueError as missing:
            console.print(str(missing))
            continue
        trials.append(trial)
        console.print(_line(trial))
        if results:
            with results.open("a") as file:
                file.write(encoder.dumps(asdict(trial)) + "\n")
    if json:
        print(encoder.dumps({"trials": [asdict(trial) for trial in trials]}))
    else:
        _print(trials)
    return 0 if trials and all(trial.succeeded for trial in trials) else 1


def _read(results: Path | None) -> dict[tuple[Family, int, float, float], WayTrial]:
    """Trials of a file by family, number, width and stiffness."""
    if results is None or not results.exists():
        return {}
    lines = results.read_text().splitlines()
    trials = [WayTrial(**encoder.loads(line)) for line in lines if line]
    return {(t.family, t.number, t.gap, t.stiffness_error): t for t in trials}


def _line(trial: WayTrial) -> str:
    found = (
        f"{trial.clearance_mm:.1f} mm clear, tips {trial.tip_error_mm:.2f} mm"
        if trial.clearance_mm is not None
        else trial.reason
    )
    return (
        f"{trial.family}-{trial.number}, {trial.gap:g} diameters: planned in {trial.plan_s:.1f} s "
        f"of processor time; {found}"
    )


def _print(trials: Sequence[WayTrial]) -> None:
    table = Table(
        caption="plant: Lariat's rod with three times the model's edges, open loop; plan: processor"
        " time"
    )
    for name in (
        "family",
        "gap [diameters]",
        "planned",
        "succeeded",
        "least clearance [mm]",
        "tip error median / worst [mm]",
        "shape error median / worst [mm]",
        "plan p50 / p90 [s]",
    ):
        table.add_column(name, justify="right")
    groups = sorted({(t.family, t.gap) for t in trials})
    for kind, width in groups:
        _add_row(
            table, kind, f"{width:g}", [t for t in trials if (t.family, t.gap) == (kind, width)]
        )
    table.add_section()
    _add_row(table, "all", "", list(trials))
    Console().print(table)


def _add_row(table: Table, family: str, gap: str, trials: list[WayTrial]) -> None:
    driven = [t for t in trials if t.clearance_mm is not None]
    plans = [t.plan_s for t in trials]
    table.add_row(
        family,
        gap,
        f"{len(driven)} / {len(trials)}",
        f"{sum(t.succeeded for t in trials)}",
        f"{min((t.clearance_mm or 0.0 for t in driven), default=np.nan):.1f}",
        _spread([t.tip_error_mm or 0.0 for t in driven]),
        _spread([t.shape_error_mm or 0.0 for t in driven]),
        f"{np.quantile(plans, 0.5):.1f} / {np.quantile(plans, 0.9):.1f}" if plans else "-",
    )


def _spread(values: list[float]) -> str:
    return f"{np.median(values):.2f} / {max(values):.2f}" if values else "-"
