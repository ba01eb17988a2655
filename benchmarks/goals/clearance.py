"""Calibration of the clearance that paths keep with a stated probability.

A path is planned for the rope as it is believed to be, with stated deviations of stiffness, length
and grips. Finer rods, drawn from the same statement, are then driven along it, open loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.campaign import CampaignOptions, Trial, groups
from benchmarks.tables import Result
from environments.scenes import KINDS, Kind, sample_scene
from lariat.control.estimation.rope_unknowns import RopeUnknowns
from lariat.geometry import polylines
from lariat.geometry.swept_clearance import swept_clearance
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.certain_clearance import certain_clearance, drawn_ropes, driven_rope
from lariat.planning.whole_path import plan
from lariat.rod import Rod, state_along
from lariat.scenario import load

BASE_SCENARIO = Path("three-cylinders")
"""Scenario of rope and limits."""
LARGEST_DEVIATIONS = {
    "bending_stiffness": 0.3,
    "length": 0.006,
    "grip_offset": 0.002,
    "grip_rotation": np.radians(2.0),
}
"""Standard deviations of the unknowns [their units] that are known least; of each path, a share."""
LEAST_SHARE = 0.2
"""Least share of them [-]."""
LARGEST_RATE = 0.02
"""Rate of ropes that come closer than stated with 99 % whose upper 95 % bound is wanted [-]."""
PLANT_NODES, PLANT_SUBSTEPS = 118, 5
"""Nodes of a driven rod, and its implicit steps per point of a path."""

CONDITIONS = (
    f"plant: Lariat's rod, n = {PLANT_NODES} (model: 40), open loop; stiffness, length and grips "
    "drawn from stated deviations, nothing sensed, not adapting; closer: than the path keeps with "
    "99 %; medians over paths"
)


@dataclass(frozen=True)
class ClearanceSpec:
    """Scene by its kind, number and seed."""

    kind: Kind
    number: int
    seed: int
    ropes: int
    """Number of rods that are driven along its path."""


def calibrate(
    kinds: Sequence[Kind], numbers: range, seed: int, ropes: int, options: CampaignOptions
) -> int:
    """Drive ropes along the path of each scene and print how many come closer than stated.

    Returns 0 if the upper 95 % bound of their rate is at most `LARGEST_RATE`, else 1.
    """
    specs = [ClearanceSpec(kind, number, seed, ropes) for kind in kinds for number in numbers]
    trials = options.trials(run_trial, specs)
    rows = [summary(kind, of) for (kind,), of in groups(trials, "kind").items()]
    total = summary("all", trials)
    options.publish(
        Result("summary", [*rows, total], CONDITIONS), details=[Result("trials", trials)]
    )
    return 0 if total["rate_upper_95"] <= LARGEST_RATE else 1


def run_trial(spec: ClearanceSpec) -> Trial:
    """Plan a path, state its clearance, and drive rods along it."""
    scenario = sample_scene(spec.kind, spec.number, spec.seed, load(BASE_SCENARIO))
    problem = scenario_problem(scenario)
    path = plan(problem)
    if not path.reached:
        raise ValueError(f"{scenario.name}: {path.reason}")
    random = np.random.default_rng([spec.seed, spec.number, KINDS.index(spec.kind)])
    unknowns, share = RopeUnknowns.of(problem.rod.properties), random.uniform(LEAST_SHARE, 1.0)
    deviations = share * unknowns.per_unknown(lambda p: LARGEST_DEVIATIONS.get(p.name, 0.0))
    known = unknowns, np.zeros(unknowns.count), np.diag(deviations**2)
    seeds = random.integers(2**32, size=2).tolist()
    drawn = drawn_ropes(problem.rod, *known, seed=seeds[0])
    stated = certain_clearance(replace(problem, drawn=drawn), path)
    rod, radius = Rod(problem.rod.properties, PLANT_NODES), problem.radius
    nodes = polylines.resample_smooth(problem.state.positions, PLANT_NODES)
    plant = replace(problem, rod=rod, state=state_along(nodes, *path.orientations[0]))
    ropes = drawn_ropes(rod, *known, seed=seeds[1], count=spec.ropes)
    motions = [driven_rope(plant, path, rope, substeps=PLANT_SUBSTEPS) for rope in ropes]
    least = [swept_clearance(m, radius, problem.obstacles) for m in motions if m is not None]
    return {
        "share": share,
        "clearance_mm": 1e3 * path.clearance,
        "certain_clearance_mm": 1e3 * stated,
        "least_mm": [1e3 * clearance for clearance in least],
        "ropes": len(least),
        "closer": sum(clearance < stated for clearance in least),
    }


def summary(scene: str, trials: Sequence[Trial]) -> dict[str, Any]:
    """Return how often ropes came closer than stated, with the upper 95 % bound of that rate."""
    ropes, closer = (sum(t[name] for t in trials) for name in ("ropes", "closer"))
    bound = binomtest(closer, ropes, alternative="less").proportion_ci(0.95, "exact").high
    columns = ("clearance_mm", "certain_clearance_mm")
    medians = {name: float(np.median([t[name] for t in trials])) for name in columns}
    counts = {"paths": len(trials), "ropes": ropes, "closer": closer, "rate": closer / ropes}
    return {"scene": scene, **counts, "rate_upper_95": float(bound), **medians}
