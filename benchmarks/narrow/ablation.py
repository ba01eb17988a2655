"""What each part of the planner is worth: `lariat bench narrow ablation`."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import product
from pathlib import Path
from typing import Any, cast
from unittest.mock import patch

import numpy as np
from jaxtyping import Float64

from benchmarks.campaign import Campaign, Workers, success_interval
from benchmarks.narrow.scenes import FAMILIES, GAPS, Family, drive, sample_scene
from benchmarks.narrow.trial import MAX_SHAPE_ERROR
from benchmarks.tables import Result, publish
from environments.scenes import Kind
from environments.scenes import sample_scene as sample_open_scene
from lariat.geometry import polylines
from lariat.planning import refinement, retiming, seeds, whole_path
from lariat.planning.alternatives import duration, travel
from lariat.planning.arms.arm_check import goal_fault
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.problem import Problem
from lariat.planning.tree_search.search import TreeSearch
from lariat.rod import Rod
from lariat.scenario import Scenario, load
from lariat.scenario.shipped import find
from lariat.simulation.plants.factory import true_properties

ONE_PACE = replace(
    retiming.RETIMING_SETTINGS, paces=retiming.RETIMING_SETTINGS.paces[2:3], close_paces=()
)
"""Retiming at one pace."""
NO_CLOSE_PACES = replace(retiming.RETIMING_SETTINGS, close_paces=())
"""Retiming without the paces for narrow openings."""
OPEN_SCENES: dict[str, tuple[Kind, str]] = {
    "posts on a table": ("hard", "three-cylinders"),
    "boxes": ("boxes", "three-cylinders"),
    "slot": ("slot", "three-cylinders"),
    "rotating": ("rotating", "three-cylinders"),
    "two arms": ("easy", "two-arms"),
}
"""Kinds of `lariat bench goals`, and the scenario of the cell, by family."""


def _direct(find: Callable[..., list[Any]]) -> Callable[..., list[Any]]:
    """Seeds of which only the first is kept."""
    return lambda *arguments: find(*arguments)[:1]


def _certain(plan: Callable[..., Any], problem: Problem) -> Any:
    """Plan as if the rope's properties were certain."""
    return plan(replace(problem, variants=()))


Part = tuple[tuple[Any, str, Any], ...]
"""Replacements that switch a part off: owner, name, and what takes its place."""
PARTS: dict[str, Part] = {
    "nothing": (),
    "seeds around obstacles": ((whole_path, "seed_paths", _direct(seeds.seed_paths)),),
    "tree search": ((whole_path, "_search_trees", lambda *_: whole_path.Searched()),),
    "passages": ((TreeSearch, "_thread", lambda *_: np.zeros(0, dtype=int)),),
    "shortening": ((TreeSearch, "_shortened", lambda _, grips: grips),),
    "proof of no path": ((whole_path, "proof_of_no_path", lambda *_: ""),),
    "optimizer": ((PathOptimizer, "refine", lambda _, start, *__: start),),
    "uncertainty": ((whole_path, "plan", partial(_certain, whole_path.plan)),),
    "paces": ((refinement, "retime", partial(retiming.retime, settings=ONE_PACE)),),
    "close paces": ((refinement, "retime", partial(retiming.retime, settings=NO_CLOSE_PACES)),),
}
"""Parts of the planner by name."""


@dataclass(frozen=True)
class AblationSpec:
    """Plan to make."""

    off: str
    """Part that is switched off."""
    family: str
    gap: float
    """Width of the opening in rope diameters; 0 where there is none [-]."""
    number: int
    seed: int


@dataclass(frozen=True)
class AblationTrial:
    """Plan, and what the plant did along it."""

    spec: AblationSpec
    planned: bool
    """Whether the planner says that its path reaches the goal."""
    reached: bool
    """Whether the plant, driven along it, touches nothing and ends at the goal."""
    plan_cpu_s: float
    """Processor time of the plan [s]."""
    clearance_mm: float
    """Least clearance of the plant along the path."""
    error_mm: float
    """Mean distance of the plant's nodes from the goal at its end."""
    duration_s: float
    """Duration of the path [s]."""
    travel_m: float
    """Length of the grips' paths, on average [m]."""


def run(
    off: tuple[str, ...] = tuple(PARTS),
    family: tuple[str, ...] = (*FAMILIES, *OPEN_SCENES),
    gap: tuple[float, ...] = GAPS,
    count: int = 8,
    first: int = 0,
    seed: int = 0,
    results: Path | None = None,
    workers: Workers = 1,
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Plan paths with each part of the planner switched off in turn, over the same scenes.

    The plant, Lariat's rod with three times the model's edges and the stiffness that the planner
    believes, is driven along each path without feedback: it judges, not the planner's own checks.

    Examples:
      lariat bench narrow ablation --workers 2 --results ablation.jsonl
      lariat bench narrow ablation --off nothing "tree search" --family posts --gap 2 --count 3

    Args:
        off: Parts to switch off.
        family: Families of scenes: those of `lariat bench narrow`, and kinds without an opening.
        gap: Widths of the openings in rope diameters.
        count: Number of scenes of each family and width.
        first: Number of the first scene.
        seed: Seed of the scenes.
        results: File of finished trials, one JSON object a line; trials that it holds are not run
            again.
        workers: Number of processes, or the address of a Dask scheduler.
        json: Print one JSON object instead of a table: `trials`, and the `summary`.
        output: Folder for the same as CSV.
    """
    specs = [
        AblationSpec(part, kind, width, number, seed)
        for number, kind in product(range(first, first + count), family)
        for width, part in product((0.0,) if kind in OPEN_SCENES else gap, off)
    ]
    trials = Campaign(run_trial, AblationTrial, _line).trials(specs, results, workers)
    rows = [summary(part, [t for t in trials if t.spec.off == part]) for part in off]
    conditions = (
        f"reached: driven along the path, the plant ends within {MAX_SHAPE_ERROR:g} mm and touches "
        "nothing; plant: rod, n = 118 (model: 40); open loop, stiffness as believed; medians over "
        "what was reached; plan: processor time"
    )
    publish([Result("summary", rows, conditions)], json, output, [Result("trials", trials)])
    return 0


def run_trial(spec: AblationSpec) -> AblationTrial:
    """Plan a path and drive the plant along it.

    Raises:
        ValueError: There is no such part, or no such scene.
    """
    if spec.off not in PARTS:
        raise ValueError(f"no part of the planner is called {spec.off!r}: {', '.join(PARTS)}")
    scenario, goal = _scene(spec.family, spec.number, spec.seed, spec.gap)
    problem = scenario_problem(scenario)
    if fault := goal_fault(problem):
        raise ValueError(f"{spec.family}-{spec.number}: at the goal itself, {fault}")
    patches = [patch.object(*replacement) for replacement in PARTS[spec.off]]
    for one in patches:
        one.start()
    try:
        began = time.process_time()
        path = whole_path.plan(problem)
        took = time.process_time() - began
    finally:
        for one in patches:
            one.stop()
    rod = Rod(true_properties(scenario), scenario.plant_rope.node_count)
    start = problem.state.positions
    clearance, nodes = drive(
        rod, scenario.bodies, path.positions, path.orientations, path.dt, -np.inf, start
    )
    error = 1e3 * polylines.mean_node_distance(nodes, polylines.resample(goal, len(nodes)))
    return AblationTrial(
        spec,
        planned=path.reached,
        reached=error <= MAX_SHAPE_ERROR and clearance > 0.0,
        plan_cpu_s=took,
        clearance_mm=1e3 * clearance,
        error_mm=error,
        duration_s=duration(path),
        travel_m=travel(path),
    )


@lru_cache(maxsize=1)
def _scene(
    family: str, number: int, seed: int, gap: float
) -> tuple[Scenario, Float64[np.ndarray, "n 3"]]:
    """Scenario that the trials of all parts share, and the nodes of the plant at its goal [m]."""
    if family not in OPEN_SCENES:
        scene = sample_scene(cast(Family, family), number, seed, gap)
        return scene.scenario, scene.goal_nodes
    kind, cell = OPEN_SCENES[family]
    base = load(find(cell))
    base = replace(base, plant=replace(base.plant, model="rod"))
    scenario = sample_open_scene(kind, number, seed, base)
    nodes = scenario.nodes(scenario.goal)
    assert nodes is not None
    return scenario, nodes


def _line(trial: AblationTrial) -> str:
    spec = trial.spec
    verdict = "reached" if trial.reached else "planned, missed" if trial.planned else "no path"
    return (
        f"{spec.family}-{spec.number}, {spec.gap:g} diameters, without {spec.off}: {verdict}, "
        f"{trial.error_mm:.1f} mm off, {trial.clearance_mm:.1f} mm clear, "
        f"{trial.plan_cpu_s:.1f} s of processor time"
    )


def summary(off: str, trials: Sequence[AblationTrial]) -> dict[str, object]:
    """Return the row of a part."""
    good = [t for t in trials if t.reached]
    plans = [t.plan_cpu_s for t in trials] or [np.nan]

    def median(name: str) -> float | None:
        return float(np.median([getattr(t, name) for t in good])) if good else None

    return {
        "without": off,
        "scenes": len(trials),
        "planned": sum(t.planned for t in trials),
        "reached": len(good),
        "rate_95": list(success_interval(len(good), len(trials))) if trials else None,
        "plan_p50_s": float(np.quantile(plans, 0.5)),
        "plan_p90_s": float(np.quantile(plans, 0.9)),
        "clearance_mm": median("clearance_mm"),
        "duration_s": median("duration_s"),
        "travel_m": median("travel_m"),
    }
