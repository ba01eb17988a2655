"""What each part of the planner is worth: `lariat bench narrow ablation`."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.campaign import CAMPAIGN_DEFAULTS, CampaignOptions, Trial, groups
from benchmarks.narrow.scenes import FAMILIES, GAPS, Family, WayScene, drive, sample_scene
from benchmarks.narrow.trial import MAX_SHAPE_ERROR
from benchmarks.tables import Flat, Result
from lariat.geometry import polylines
from lariat.geometry.grips import Grips
from lariat.planning import refinement, retiming, whole_path
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.seeds import seed_paths
from lariat.planning.tree_search.search import TreeSearch
from lariat.rod import Rod
from lariat.simulation.plants.factory import true_properties

PARTS: dict[str, tuple[tuple[Any, str, Any], ...]] = {
    "nothing": (),
    "seeds around obstacles": ((refinement, "seed_paths", lambda p: seed_paths(p)[:1]),),
    "tree searches": ((whole_path, "_search_trees", lambda *_: whole_path.Searched()),),
    "searches but the first": ((whole_path, "TREE_CLEARANCES", whole_path.TREE_CLEARANCES[:1]),),
    "motions lengthwise": ((TreeSearch, "_thread", lambda *_: np.zeros(0, dtype=int)),),
    "shortening": ((TreeSearch, "_shortened", lambda _, grips: grips),),
    "optimization": ((PathOptimizer, "refine", lambda _, start, *__: start),),
    "all paces but one": (
        (retiming.retime, "__defaults__", (retiming.LINK_MARGIN, retiming.PACES[2:3])),
        (retiming, "CLOSE_PACES", ()),
    ),
    "paces for narrow openings": ((retiming, "CLOSE_PACES", ()),),
}
"""Parts by name: owner, name and substitute of what is replaced while a part is switched off."""


@dataclass(frozen=True)
class PlanSpec:
    """Scene by family, width of the opening [rope diameters], number and seed."""

    without: str
    """Part that is switched off."""
    family: Family
    gap: float
    number: int
    seed: int


def run(
    without: tuple[str, ...] = tuple(PARTS),
    family: tuple[Family, ...] = FAMILIES,
    gap: tuple[float, ...] = GAPS,
    count: int = 2,
    first: int = 0,
    seed: int = 0,
    options: Flat[CampaignOptions] = CAMPAIGN_DEFAULTS,
) -> int:
    """Plan paths with each part of the planner switched off in turn, over the same scenes.

    The plant, Lariat's rod with three times the model's edges and the stiffness that the planner
    believes, is driven along each path without feedback: it judges, not the planner's own checks.

    Examples:
      lariat bench narrow ablation --count 10 --seed 900 --workers 2 --results ablation.jsonl
      lariat bench narrow ablation --without nothing "tree searches" --family posts --gap 2

    Args:
        without: Parts to switch off.
        family: Families of scenes.
        gap: Widths of the openings in rope diameters.
        count: Number of scenes of each family and width.
        first: Number of the first scene.
        seed: Seed of the scenes.
    """
    specs = [
        PlanSpec(part, kind, width, number, seed)
        for number, kind, width, part in product(range(first, first + count), family, gap, without)
    ]
    trials = options.trials(run_trial, specs)
    rows = [_summary(part, own) for (part,), own in groups(trials, "without").items()]
    conditions = (
        f"reached: driven along the path, the plant ends within {MAX_SHAPE_ERROR:g} mm and touches "
        "nothing; plant: rod, n = 118 (model: 40); open loop, stiffness as believed; plan: "
        "processor time; clearance and duration: medians over what was reached"
    )
    options.publish(Result("summary", rows, conditions), details=[Result("trials", trials)])
    return 0


def run_trial(spec: PlanSpec) -> Trial:
    """Plan a path and drive the plant along it."""
    if spec.without not in PARTS:
        raise ValueError(f"no part of the planner is called {spec.without!r}: {', '.join(PARTS)}")
    scene = _scene(spec.family, spec.number, spec.seed, spec.gap)
    problem = scenario_problem(scene.scenario)
    with ExitStack() as replaced:
        for replacement in PARTS[spec.without]:
            replaced.enter_context(patch.object(*replacement))
        began = time.process_time()
        path = whole_path.plan(problem)
        took = time.process_time() - began
    rod = Rod(true_properties(scene.scenario), scene.scenario.plant_rope.node_count)
    grips = Grips(path.positions, path.orientations)
    clearance, nodes = drive(rod, scene.scenario.bodies, grips, path.dt, least=-np.inf)
    error = polylines.mean_node_distance(nodes, scene.goal_nodes)
    return {
        "planned": path.reached,
        "reached": 1e3 * error <= MAX_SHAPE_ERROR and clearance > 0.0,
        "plan_cpu_s": took,
        "clearance_mm": 1e3 * clearance,
        "error_mm": 1e3 * error,
        "duration_s": len(path.positions) * path.dt,
    }


@lru_cache(maxsize=1)
def _scene(family: Family, number: int, seed: int, gap: float) -> WayScene:
    """Scene that the trials of all parts share."""
    return sample_scene(family, number, seed, gap)


def _summary(without: str, trials: Sequence[Trial]) -> dict[str, object]:
    """Row of a part."""
    good = [t for t in trials if t["reached"]]

    def median(name: str) -> float | None:
        return float(np.median([t[name] for t in good])) if good else None

    plans = [t["plan_cpu_s"] for t in trials]
    return {
        "without": without,
        "scenes": len(trials),
        "planned": sum(t["planned"] for t in trials),
        "reached": len(good),
        "plan_p50_s": float(np.quantile(plans, 0.5)),
        "plan_p90_s": float(np.quantile(plans, 0.9)),
        "clearance_mm": median("clearance_mm"),
        "duration_s": median("duration_s"),
    }
