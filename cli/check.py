"""`lariat check`: check of a scenario before anything moves."""

from __future__ import annotations

import contextlib
import json as jsons
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from cli.task import LOCAL, CellOptions
from lariat.planning import preflight
from lariat.scenario import SIDES, Scenario
from lariat.scenario.plausibility import doubts
from lariat.scenario.settings import load_with
from shared import topics
from shared.cell_checks import REQUIRED_SERVICES, CellChecks, CheckResult
from stack import dependencies, services
from stack.client import Cell, Client, connect

LISTENING_TIME = 3.0
"""Time for which a running stack is listened to, by default [s]."""
POLL_PERIOD = 0.005
"""Time between two reads of the bus [s]."""


def main(
    scenario: tyro.conf.Positional[Path],
    /,
    plan: bool = False,
    alternatives: int = 1,
    nearest: Path | None = None,
    live: bool = False,
    seconds: float = LISTENING_TIME,
    json: bool = False,
    cell: CellOptions = LOCAL,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
) -> int:
    """Check a scenario: its values, and the rope at rest at its start and goal.

    Values that are allowed but plausible only by mistake, e.g. of a unit, are named. With --live,
    the running stack of the cell is checked too: processes, arms, camera, and what has been tried
    of a first day (way to the start, slow run, stop in motion, power off), as in the page's tab
    Checks. It commands nothing; listen longer to try these by the usual means meanwhile.

    Examples:
      lariat check three-cylinders
      lariat check my-cell.toml --plan
      lariat check my-cell.toml --plan --alternatives 3
      lariat check my-cell.toml --plan --nearest near.csv
      lariat check my-cell.toml --live
      lariat check my-cell.toml --live --seconds 600
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
        live: Check the running stack of the cell, too.
        seconds: Time for which --live listens [s]; each result is printed when it changes.
        json: Answer with one JSON object on standard output.
        cell: Address of the stack, for --live.
        set: Replaces one value of the scenario, as in `lariat run`; may be repeated.

    Returns:
        0 for a valid scenario; 1 if no path to the goal was found, or a check of the running stack
        has failed; 2 after one line that names the
        error.
    """
    loaded = load_with(scenario, set)
    dependencies.check(loaded, services.NAMES)
    if loaded.ros2.topics:
        dependencies.check(loaded, ["ros2"])
        from shared.ros2.table import Table

        Table.of(loaded)
    reports = preflight.check(loaded)
    starts = arm_starts(loaded)
    distances = preflight.rest_distances(loaded)
    errors = preflight.resolution_errors(loaded)
    path = planned(loaded, alternatives, nearest) if plan else {}
    code = 0 if path.get("reached", True) else 1
    if json:
        shapes = {
            key: {"clearance_mm": round(1e3 * r.clearance, 3), "nearest": r.nearest}
            for key, r in reports.items()
            if r.nearest
        }
        answer = {
            "scenario": loaded.name,
            "ok": True,
            "doubts": list(doubts(loaded)),
            "shapes": shapes,
            "rest_distance_mm": {key: round(1e3 * d, 3) for key, d in distances.items()},
            "resolution_mm": {key: round(1e3 * error, 3) for key, error in errors.items()},
            "start_joints_deg": starts,
        }
        if plan:
            answer["plan"] = path
        if live:
            results = listen(cell, loaded, seconds, quiet=True)
            answer["live"] = [asdict(result) for result in results]
            code = max(code, int(any(result.outcome == "failed" for result in results)))
        print(jsons.dumps(answer))
        return code
    print(f"{scenario} is in order: {loaded.description or loaded.name}")
    for line in doubts(loaded):
        print(f"  plausible only by mistake: {line}")
    for key, report in reports.items():
        near = (
            f"{1e3 * report.clearance:.1f} mm from {report.nearest}" if report.nearest else "free"
        )
        print(f"  {key}: {near}")
    for key, distance in distances.items():
        if distance > loaded.run.tolerance:
            print(
                f"  {key}: the rope as [rope] has it does not rest in this shape; the nearest "
                f"within reach that was found is {1e3 * distance:.1f} mm away on average"
            )
    for key, error in errors.items():
        if error > loaded.run.tolerance:
            print(
                f"  {key}: {loaded.rope.node_count} nodes are few for this rope, which hangs about "
                f"{1e3 * error:.0f} mm elsewhere; raise rope.node_count"
            )
    for side, joints in starts.items():
        print(f"  {side} arm at the start: joints {', '.join(f'{j:.1f}' for j in joints)} deg")
    if path:
        verdict = path["reason"] or "reaches the goal"
        wait = (
            f", departs after {path['departs_s']:.1f} s beside what moves"
            if path["departs_s"]
            else ""
        )
        unknown = (
            f", with 99 % {path['certain_clearance_mm']:.1f} mm before the rope is learned"
            if loaded.control.adapt
            else ""
        )
        print(
            f"  path: {verdict}; {path['duration_s']:.1f} s{wait}, {path['clearance_mm']:.1f} mm "
            f"from obstacles{unknown}, planned in {path['plan_s']:.1f} s"
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
    if live:
        results = listen(cell, loaded, seconds, quiet=False)
        code = max(code, int(any(result.outcome == "failed" for result in results)))
    return code


def listen(cell: Cell, scenario: Scenario, seconds: float, quiet: bool) -> tuple[CheckResult, ...]:
    """Listen to a running stack for some seconds, or until Ctrl-C; return its checks' results."""
    checks = CellChecks(scenario)
    with connect(cell) as client:
        _feed(checks, client, seconds, quiet)
    return checks.results()


def _feed(checks: CellChecks, client: Client, seconds: float, quiet: bool) -> None:
    """Pass what is heard on to the checks; print each result when it changes."""
    takers = {
        topics.ARM_STATE: checks.take_arms,
        topics.TASK_STATE: checks.take_task,
        topics.ROPE_NODES: checks.take_rope,
    }
    heard = [(client.bus.subscribe(topic), take) for topic, take in takers.items()]
    for name in REQUIRED_SERVICES:
        subscription = client.bus.subscribe(topics.HEALTH.at(name))
        heard.append((subscription, partial(checks.take_health, name)))
    begun, shown = time.monotonic(), {}
    with contextlib.suppress(KeyboardInterrupt):
        while (age := time.monotonic() - begun) < seconds:
            for subscription, take in heard:
                for _, item in subscription.take():
                    take(item.message)
            # Before everything was heard once, results say nothing.
            if not quiet and age > min(LISTENING_TIME, seconds) - 2.0 * POLL_PERIOD:
                for result in checks.results():
                    if shown.get(result.title) != result:
                        print(f"  {result.outcome:7}{result.title}: {result.detail}", flush=True)
                        shown[result.title] = result
            time.sleep(POLL_PERIOD)


def planned(cell: Scenario, alternatives: int = 1, nearest: Path | None = None) -> dict[str, Any]:
    """Return what the planner finds from start to goal: its own path, or some different ones."""
    # Imported late: the rod starts a compiler, which a check of values alone does not need.
    from lariat.planning.alternatives import alternative_paths, travel
    from lariat.planning.arms.advice import helpful_changes
    from lariat.planning.arms.arm_check import goal_fault, start_fault
    from lariat.planning.cell_problem import scenario_departure, scenario_problem
    from lariat.planning.certain_clearance import certain_clearance
    from services.planner.service import PlannerService

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
        "certain_clearance_mm": round(1e3 * certain_clearance(problem, path), 3),
        "departs_s": round(departure.after, 3),
        "duration_s": round(path.duration, 3),
        "final_error_mm": round(1e3 * path.final_error, 3),
        "plan_s": round(took, 3),
        "alternatives": [
            {
                "clearance_mm": round(1e3 * other.clearance, 3),
                "duration_s": round(other.duration, 3),
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
