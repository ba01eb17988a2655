"""`lariat check`: check of a scenario before anything moves."""

from __future__ import annotations

import json as jsons
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from lariat.scenario import SIDES, Scenario
from lariat.scenario.plausibility import doubts
from stack import dependencies, preflight, services
from stack.scenario_overrides import load_with


def main(
    scenario: tyro.conf.Positional[Path],
    /,
    plan: bool = False,
    alternatives: int = 1,
    nearest: Path | None = None,
    json: bool = False,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
) -> int:
    """Check a scenario: its values, and the rope at rest at its start and goal.

    Values that are allowed but plausible only by mistake, e.g. of a unit, are named.

    Examples:
      lariat check three-cylinders
      lariat check my-cell.toml --plan
      lariat check my-cell.toml --plan --alternatives 3
      lariat check my-cell.toml --plan --nearest near.csv
      lariat check my-cell.toml --json
      lariat check three-cylinders --set rope.diameter=0.012

    Args:
        scenario: The scenario's TOML file, or the short name of a shipped one.
        plan: Plan a path from the start to the goal, too. Where an arm cannot hold the goal, say
            which moves of its base or turns of its grip would help.
        alternatives: Largest number of different paths that are listed with --plan: those with the
            most clearance first, then the fastest. A run follows the one that --plan alone finds.
        nearest: CSV file to which --plan writes the nodes of the nearest shape that can be reached,
            where no path leads to the goal; e.g. for `goal.nodes`.
        json: Answer with one JSON object on standard output.
        set: Replaces one value of the scenario, as in `lariat run`; may be repeated.

    Returns:
        0 for a valid scenario; 1 if no path to the goal was found; 2 after one line that names the
        error.
    """
    cell = load_with(scenario, set)
    dependencies.check(cell, services.NAMES)
    reports = preflight.check(cell)
    starts = arm_starts(cell)
    path = planned(cell, alternatives, nearest) if plan else {}
    if json:
        shapes = {
            key: {"clearance_mm": round(1e3 * r.clearance, 3), "nearest": r.nearest}
            for key, r in reports.items()
            if r.nearest
        }
        answer = {
            "scenario": cell.name,
            "ok": True,
            "doubts": list(doubts(cell)),
            "shapes": shapes,
            "start_joints_deg": starts,
        }
        if plan:
            answer["plan"] = path
        print(jsons.dumps(answer))
        return 0 if path.get("reached", True) else 1
    print(f"{scenario} is in order: {cell.description or cell.name}")
    for line in doubts(cell):
        print(f"  plausible only by mistake: {line}")
    for key, report in reports.items():
        near = (
            f"{1e3 * report.clearance:.1f} mm from {report.nearest}" if report.nearest else "free"
        )
        print(f"  {key}: {near}")
    for side, joints in starts.items():
        print(f"  {side} arm at the start: joints {', '.join(f'{j:.1f}' for j in joints)} deg")
    if path:
        found = path["reason"] or "reaches the goal"
        wait = (
            f", departs after {path['departs_s']:.1f} s beside what moves"
            if path["departs_s"]
            else ""
        )
        print(
            f"  path: {found}; {path['duration_s']:.1f} s{wait}, {path['clearance_mm']:.1f} mm "
            f"from obstacles, planned in {path['plan_s']:.1f} s"
        )
        for k, way in enumerate(path["alternatives"], start=1):
            print(
                f"  path {k}: {way['duration_s']:.1f} s, grips travel {way['travel_m']:.2f} m, "
                f"{way['clearance_mm']:.1f} mm from obstacles"
            )
        if nearest is not None and not path["reached"]:
            print(
                f"  nearest shape, {path['final_error_mm']:.0f} mm from the goal on average: "
                f"{nearest}"
            )
        if path["start_fault"]:
            print(f"  at the start itself, {path['start_fault']}")
        for words in path["would_help"]:
            print(f"  would help: {words}")
    return 0 if path.get("reached", True) else 1


def planned(cell: Scenario, alternatives: int = 1, nearest: Path | None = None) -> dict[str, Any]:
    """Return what the planner finds from the scenario's start to its goal.

    Args:
        cell: Scenario.
        alternatives: Largest number of different paths; 1 for the planner's own alone.
        nearest: File for the nearest shape that can be reached, where no path leads to the goal.
    """
    # Imported late: the rod starts a compiler, which a check of values alone does not need.
    from lariat.planning.alternatives import alternative_paths, duration, travel
    from lariat.planning.arms.arm_check import goal_fault, start_fault
    from services.planner.service import PlannerService
    from stack.arm_advice import helpful_changes
    from stack.planning import scenario_departure, scenario_problem

    PlannerService(cell).warm_up()
    problem = scenario_problem(cell)
    began = time.perf_counter()
    departure = scenario_departure(cell, problem)
    path = departure.path
    took = time.perf_counter() - began
    if nearest is not None and not path.reached:
        np.savetxt(nearest, path.nodes[-1], delimiter=",", fmt="%.6f")
    others = alternative_paths(problem, alternatives) if alternatives > 1 and path.reached else []
    return {
        "reached": path.reached,
        "reason": path.reason,
        "clearance_mm": round(1e3 * path.clearance, 3),
        "departs_s": round(departure.after, 3),
        "duration_s": round(len(path.positions) * path.dt, 3),
        "final_error_mm": round(1e3 * path.final_error, 3),
        "plan_s": round(took, 3),
        "alternatives": [
            {
                "clearance_mm": round(1e3 * other.clearance, 3),
                "duration_s": round(duration(other), 3),
                "travel_m": round(travel(other), 3),
            }
            for other in others
        ],
        "start_fault": str(start_fault(problem) or ""),
        "would_help": helpful_changes(cell) if goal_fault(problem) else [],
    }


def arm_starts(cell: Scenario) -> dict[str, list[float]]:
    """Return the joint angles of each CR5 at the scenario's start [deg], e.g. to jog a real one."""
    sides = [side for side in SIDES if cell.end(side).driver == "cr5"]
    if not sides:
        return {}
    # Imported late: only a cell with such an arm needs Pinocchio.
    from lariat.arms.cr5_installation import scenario_joints

    return {side: [round(j, 2) for j in scenario_joints(cell, side)] for side in sides}
