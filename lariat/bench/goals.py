"""Random goals low behind the paper's three cylinders, each a whole run: `lariat bench goals`.

Every goal is a rest shape of the true rope. Starts, cylinders and limits are those of
`scenarios/three-cylinders.toml`; the services run as in `lariat run`.
"""

from __future__ import annotations

import json as encoder
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float64

from lariat import closed_loop
from lariat.closed_loop import Score
from shared.geometry.clearance import gripper_points
from shared.geometry.obstacles import chain_clearance, signed_distance
from shared.geometry.poses import Pose
from shared.rod import Rod, RodProperties
from shared.scenario import Scenario, Shape, load

BASE = Path(__file__).parents[2] / "scenarios" / "three-cylinders.toml"
SPARE = 0.015
"""Clearance of a goal itself [m]."""


def run(
    goals: int = 20,
    seed: int = 0,
    plant: Literal["rod", "mujoco"] = "rod",
    stiffness_factor: float = 1.0,
    youngs_modulus: float = 1.0e6,
    sensing: Literal["truth", "camera"] = "truth",
    adapt: bool = False,
    planner: bool = True,
    method: Literal["gauss_newton", "network", "actions"] = "gauss_newton",
    time_limit: float = 8.0,
    json: bool = False,
) -> int:
    """Runs random goals behind the wall and prints error, clearance and time of each.

    Args:
        goals: How many.
        seed: Of the goals.
        plant: What plays the true rope.
        stiffness_factor: Of the true rope against what the controller believes.
        youngs_modulus: That the controller believes [Pa].
        sensing: How the rope is seen.
        adapt: Whether the controller learns the stiffness.
        planner: Whether whole paths are planned.
        method: Of control.
        time_limit: Of each run [s].
        json: One JSON object instead of a table.
    """
    base = load(BASE)
    base = replace(
        base,
        rope=replace(base.rope, youngs_modulus=youngs_modulus),
        plant=replace(
            base.plant,
            model=plant,
            rope=replace(base.plant.rope, youngs_modulus=youngs_modulus * stiffness_factor),
        ),
        sensing=replace(base.sensing, source=sensing),
        control=replace(base.control, method=method, adapt=adapt, planner=planner),
        run=replace(base.run, time_limit=time_limit),
    )
    scores: list[Score] = []
    with tempfile.TemporaryDirectory() as folder:
        for k, nodes in enumerate(goal_shapes(base, goals, seed)):
            np.savetxt(Path(folder) / f"goal-{k}.csv", nodes, delimiter=",")
            scenario = replace(base, folder=Path(folder), goal=Shape(nodes=f"goal-{k}.csv"))
            score = replace(closed_loop.run(scenario).score, scenario=f"goal-{k}")
            scores.append(score)
            print(_row(score), file=sys.stderr, flush=True)
    summary = _summary(scores)
    if json:
        print(encoder.dumps({"summary": summary, "runs": [asdict(s) for s in scores]}))
    else:
        print("\n".join(f"{name:24s} {value}" for name, value in summary.items()))
    return 0 if summary["reached within 1 mm"] == len(scores) else 1


def goal_shapes(scenario: Scenario, count: int, seed: int) -> Iterator[Float64[np.ndarray, "n 3"]]:
    """Rest shapes of the true rope, low behind the cylinders, turned and tilted by chance [m]."""
    random = np.random.default_rng(seed)
    true = {k: v for k, v in vars(scenario.plant_rope).items() if k != "node_count"}
    rod = Rod(RodProperties(**true), scenario.rope.node_count)
    start = scenario.grips(scenario.start)
    limits, radius = scenario.limits, scenario.rope.diameter / 2.0
    found = 0
    while found < count:
        half, yaw, tilt = random.uniform((0.08, -0.7, -0.3), (0.2, 0.7, 0.3))
        centre = random.uniform((-0.08, 0.07, 0.08), (0.08, 0.25, 0.20))
        chord = half * np.array([np.cos(yaw), np.sin(yaw), tilt])
        left = Pose(centre - chord, start[0].orientation)
        right = Pose(centre + chord, start[1].orientation)
        try:
            rest = rod.rest(left, right)
        except ValueError:
            continue
        nodes = rest.state.positions
        bodies = gripper_points(left, right, limits.gripper_height)
        body = min(float(np.min(signed_distance(bodies, o))) for o in scenario.bodies)
        if (
            rest.converged
            and rest.stable
            and chain_clearance(nodes, radius, scenario.bodies) > SPARE
            and body > limits.gripper_radius + SPARE
            and min(left.position[2], right.position[2]) > 0.03
        ):
            found += 1
            yield nodes


def _row(score: Score) -> str:
    return (
        f"{score.scenario:8s} error {score.final_error_mm} mm (worst node "
        f"{score.max_node_error_mm} mm), clearance {score.min_clearance_mm} mm, length "
        f"{score.length_error_mm} mm, within {score.reached_s} s, step p50 "
        f"{score.plan_ms['p50']} ms"
    )


def _summary(scores: list[Score]) -> dict[str, float]:
    """What the runs together show; a run without an error never moved and counts as missed."""
    errors = np.array([np.nan if s.final_error_mm is None else s.final_error_mm for s in scores])
    clearances = [s.min_clearance_mm for s in scores if s.min_clearance_mm is not None]
    reached = [s.reached_s for s in scores if s.reached_s is not None]
    return {
        "goals": len(scores),
        "reached within 1 mm": int(np.sum(errors < 1.0)),
        "reached within 3 mm": int(np.sum(errors < 3.0)),
        "mean error [mm]": round(float(np.nanmean(errors)), 4),
        "worst error [mm]": round(float(np.nanmax(errors)), 4),
        "least clearance [mm]": round(min(clearances, default=float("nan")), 2),
        "touched": sum(s.contact_time_s > 0.0 for s in scores),
        "worst length error [mm]": max((s.length_error_mm for s in scores), default=0.0),
        "median time to 5 mm [s]": round(float(np.median(reached)), 2) if reached else np.nan,
        "step p50 [ms]": round(float(np.median([s.plan_ms["p50"] for s in scores])), 2),
        "step p99 [ms]": round(float(np.median([s.plan_ms["p99"] for s in scores])), 2),
    }
