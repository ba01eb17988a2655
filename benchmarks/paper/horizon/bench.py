"""Time to plan one horizon, and error of its prediction: `lariat bench paper horizon`."""

from __future__ import annotations

import json as encoder
from dataclasses import asdict
from pathlib import Path
from typing import Literal

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.paper.horizon.errors import MAX_NOISE_RATIO, HorizonErrors, horizon_errors
from benchmarks.paper.horizon.times import Method, planning_times
from benchmarks.result_block import find_block, show
from lariat.scenario import load

BASE_SCENARIO = "three-cylinders"
"""Scenario of rope, goal and obstacles of the timed horizons."""
PAPER_HORIZON_MS = 1700.0
"""Time of one horizon that the paper reports [ms]."""


def run(
    method: tuple[Method, ...] = ("gauss_newton", "actions", "network"),
    nodes: tuple[int, ...] = (40,),
    calls: int = 200,
    errors: tuple[str, ...] = ("three-cylinders", "markers", "rope", "cable"),
    plant: tuple[Literal["rod", "mujoco", "links"], ...] = (),
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Time the planning of one horizon [ms], and compare its prediction with the true rope [mm].

    Wall time on one core; for the times, the plant is the same rod as the model, whose state is
    known, and the controller does not adapt. The errors are those of whole runs with the camera:
    the plant has three times the model's edges, and rope and cable adapt. Each takes half a minute.

    Examples:
      lariat bench paper horizon --method gauss_newton --nodes 20 40 80 --errors
      lariat bench paper horizon --calls 0 --errors three-cylinders cable --plant rod links

    Args:
        method: Control methods to time.
        nodes: Numbers of nodes of the rope to time.
        calls: Number of timed horizons for each method and number of nodes.
        errors: Names of the shipped scenarios whose predictions are measured.
        plant: Simulators of the true rope for the errors; by default the scenario's.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of tables.

    Returns:
        0 if every prediction error is at most twice the noise, else 1.
    """
    block = find_block(docs)
    times = _times(method, nodes, calls) if calls else []
    cases = [(name, model) for name in errors for model in (plant or (None,))]
    measured = [
        horizon_errors(*case)
        for case in track(cases, "Errors", console=Console(stderr=True), transient=True)
    ]
    if json:
        rows = [{**asdict(row), "ratio": row.ratio} for row in measured]
        print(encoder.dumps({"ms": times, "paper_ms": PAPER_HORIZON_MS, "errors": rows}))
    else:
        show(_tables(times, measured), block)
    return 0 if all(row.ratio <= MAX_NOISE_RATIO for row in measured) else 1


def _times(
    methods: tuple[Method, ...], nodes: tuple[int, ...], calls: int
) -> list[dict[str, float | str]]:
    base = load(BASE_SCENARIO)
    rows: list[dict[str, float | str]] = []
    for count in nodes:
        for name in methods:
            times = planning_times(base, name, count, calls)
            p50, p99, longest = np.quantile(times, [0.5, 0.99, 1.0]).round(3).tolist()
            rows.append({"method": name, "nodes": count, "p50": p50, "p99": p99, "max": longest})
    return rows


def _tables(times: list[dict[str, float | str]], errors: list[HorizonErrors]) -> list[Table]:
    tables = []
    if times:
        table = Table(
            "method",
            "nodes",
            "p50 ms",
            "p99 ms",
            "max ms",
            caption="plant = model (Lariat's rod), state known, not adapting; one horizon; "
            f"the paper reports {PAPER_HORIZON_MS:g} ms, on a GPU",
        )
        for row in times:
            table.add_row(*(str(value) for value in row.values()))
        tables.append(table)
    if errors:
        table = Table(
            "scenario",
            "plant",
            "adapting",
            "error mm",
            "noise mm",
            "error / noise",
            caption="rms distance of horizons' ends, and of perceived nodes, from the moving rope",
        )
        for row in errors:
            table.add_row(
                row.scenario,
                row.conditions.plant,
                row.conditions.adapting,
                f"{row.prediction_mm:.2f}",
                f"{row.noise_mm:.2f}",
                f"{row.ratio:.1f}",
            )
        tables.append(table)
    return tables
