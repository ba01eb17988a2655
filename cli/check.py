"""`lariat check`: check of a scenario before anything moves."""

from __future__ import annotations

import json as jsons
from pathlib import Path

import tyro

from shared.scenario import SIDES, Scenario, load
from shared.scenario.plausibility import doubts
from stack import dependencies, preflight, services


def main(scenario: tyro.conf.Positional[Path], /, json: bool = False) -> int:
    """Check a scenario: its values, and the rope at rest at its start and goal.

    Values that are allowed but plausible only by mistake, e.g. of a unit, are named.

    Examples:
      lariat check three-cylinders
      lariat check my-cell.toml --json

    Args:
        scenario: The scenario's TOML file, or the short name of a shipped one.
        json: Answer with one JSON object on standard output.

    Returns:
        0 for a valid scenario; 2 after one line that names the error.
    """
    cell = load(scenario)
    dependencies.check(cell, services.NAMES)
    reports = preflight.check(cell)
    starts = arm_starts(cell)
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
        print(jsons.dumps(answer))
        return 0
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
    return 0


def arm_starts(cell: Scenario) -> dict[str, list[float]]:
    """Return the joint angles of each CR5 at the scenario's start [deg], e.g. to jog a real one."""
    sides = [side for side in SIDES if cell.end(side).driver == "cr5"]
    if not sides:
        return {}
    # Imported late: only a cell with such an arm needs Pinocchio.
    from shared.cr5.installation import scenario_joints

    return {side: [round(j, 2) for j in scenario_joints(cell, side)] for side in sides}
