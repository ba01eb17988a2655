"""The paper's goals by what Lariat ships: a planner's whole path, Gauss-Newton control, a gateway.

Nothing is left out: the services run as in `lariat run`, and the arms keep their limits.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.paper.closed_loop import STEP
from benchmarks.paper.goals import SCENARIO, START, Goal
from benchmarks.paper.studies import NODES
from lariat.rod import Rod
from shared.scenario import Rope, Scenario, Shape, load
from stack.simulation import closed_loop
from stack.simulation.closed_loop import Score

NAME = "direct, gauss_newton along a whole path, through the gateway"
CLEARANCE = 0.02
"""That paths keep between surfaces [m]."""
LINEAR_DENSITY = 0.044
"""Of a rope in place of the paper's [kg/m]: with all forces in proportion it moves alike."""


def runs(rod: Rod, goals: Sequence[Goal], steps: int) -> Iterator[Score]:
    """What comes of each goal within `steps` of the paper's 10 ms."""
    base = load(SCENARIO)
    with tempfile.TemporaryDirectory() as folder:
        for k, goal in enumerate(goals):
            file = f"goal-{k}.csv"
            np.savetxt(Path(folder) / file, goal.nodes, delimiter=",")
            scenario: Scenario = replace(
                base,
                name=f"paper-{k}",
                folder=Path(folder),
                rope=_rope(rod),
                plant=replace(base.plant, model="rod"),
                sensing=replace(base.sensing, source="truth"),
                control=replace(base.control, clearance=CLEARANCE),
                start=Shape(line=(tuple(START[0].tolist()), tuple(START[1].tolist()))),
                goal=Shape(nodes=file),
                run=replace(base.run, time_limit=steps * STEP),
            )
            yield closed_loop.run(scenario).score


def row(scores: Sequence[Score]) -> dict[str, float | str | int]:
    """Of the table; a step of the controller stands for a horizon."""
    errors = np.array([np.inf if s.final_error_mm is None else s.final_error_mm for s in scores])
    clearances = [s.min_clearance_mm for s in scores if s.min_clearance_mm is not None]
    return {
        "study": NAME,
        "goals": len(scores),
        "mean [mm]": round(float(np.mean(errors)), 3),
        "max [mm]": round(float(np.max(errors)), 3),
        "under 5 mm": int(np.sum(errors < 5.0)),
        "clearance [mm]": round(min(clearances, default=np.nan), 1),
        "length off [mm]": round(max(s.length_error_mm for s in scores), 1),
        "horizon p50 [ms]": round(float(np.median([s.plan_ms["p50"] for s in scores])), 1),
        "p99 [ms]": round(float(np.median([s.plan_ms["p99"] for s in scores])), 1),
    }


def _rope(rod: Rod) -> Rope:
    p = rod.properties
    lighter = LINEAR_DENSITY / p.linear_density
    return Rope(
        length=p.length,
        diameter=p.diameter,
        node_count=NODES,
        linear_density=LINEAR_DENSITY,
        youngs_modulus=p.youngs_modulus * lighter,
        poisson_ratio=p.poisson_ratio,
        stretch_stiffness=p.stretch_stiffness * lighter,
        damping=p.damping,
    )
