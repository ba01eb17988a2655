"""The paper's goals by the whole stack: planned paths, Gauss-Newton control, gateway.

All services run as in `lariat run`, and the arms keep their limits. The plant is Lariat's rod with
40 nodes; the controller perceives the true nodes and does not adapt.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.paper.closed_loop import PAPER_TIME_STEP
from benchmarks.paper.goals import BASE_SCENARIO, START_GRIPS, Goal
from benchmarks.paper.studies import NODE_COUNT
from lariat.rod import Rod
from lariat.scenario import Rope, Shape, load
from lariat.scenario.sections import Plant, PlantRope
from lariat.scenario.shipped import find
from stack.simulation import closed_loop
from stack.simulation.closed_loop import Score

STUDY_NAME = "direct, gauss_newton along a planned path, through the gateway"
"""Name of the study in tables."""
PATH_CLEARANCE = 0.02
"""Clearance that paths keep [m]."""
LINEAR_DENSITY = 0.044
"""Linear density of the rope [kg/m]; with all stiffnesses in proportion it moves like the
paper's."""


def runs(rod: Rod, goals: Sequence[Goal], steps: int) -> Iterator[Score]:
    """Run to each goal and yield the scores."""
    base = load(find(BASE_SCENARIO))
    for k, goal in enumerate(goals):
        scenario = replace(
            base,
            name=f"paper-{k}",
            rope=_rope(rod),
            plant=Plant(model="rod", rope=PlantRope(node_count=rod.node_count)),
            sensing=replace(base.sensing, source="truth"),
            control=replace(base.control, clearance=PATH_CLEARANCE),
            start=Shape(line=(tuple(START_GRIPS[0].tolist()), tuple(START_GRIPS[1].tolist()))),
            goal=Shape(nodes=goal.nodes),
            run=replace(base.run, time_limit=steps * PAPER_TIME_STEP),
        )
        yield closed_loop.run(scenario).score


def row(scores: Sequence[Score]) -> dict[str, float | str | int]:
    """Row of the table; the times are those of whole controller steps."""
    errors = np.array([np.inf if s.final_error_mm is None else s.final_error_mm for s in scores])
    clearances = [s.min_clearance_mm for s in scores if s.min_clearance_mm is not None]
    return {
        "study": STUDY_NAME,
        "goals": len(scores),
        "mean [mm]": round(float(np.mean(errors)), 3),
        "max [mm]": round(float(np.max(errors)), 3),
        "below 5 mm": int(np.sum(errors < 5.0)),
        "least clearance [mm]": round(min(clearances, default=np.nan), 1),
        "length error [mm]": round(max(s.length_error_mm for s in scores), 1),
        "horizon p50 [ms]": round(float(np.median([s.plan_ms["p50"] for s in scores])), 1),
        "horizon p99 [ms]": round(float(np.median([s.plan_ms["p99"] for s in scores])), 1),
    }


def _rope(rod: Rod) -> Rope:
    p = rod.properties
    ratio = LINEAR_DENSITY / p.linear_density
    return Rope(
        length=p.length,
        diameter=p.diameter,
        node_count=NODE_COUNT,
        linear_density=LINEAR_DENSITY,
        youngs_modulus=p.youngs_modulus * ratio,
        poisson_ratio=p.poisson_ratio,
        stretch_stiffness=p.stretch_stiffness * ratio,
        damping=p.damping,
    )
