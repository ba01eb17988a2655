"""`lariat check`: says what is wrong with a scenario."""

from __future__ import annotations

import json as jsons
from pathlib import Path

import tyro

from lariat import installation, preflight, services
from shared.scenario import load


def main(scenario: tyro.conf.Positional[Path], /, json: bool = False) -> int:
    """Read a scenario, let the rope hang at its start and goal, and say what is wrong.

    Examples:
      lariat check scenarios/three-cylinders.toml
      lariat check my-cell.toml --json

    Args:
        scenario: The scenario's TOML file.
        json: Answer with one JSON object on standard output.

    Returns:
        0 when nothing is wrong; 2 with one line that says what.
    """
    cell = load(scenario)
    installation.check(cell, services.NAMES)
    reports = preflight.check(cell)
    if json:
        shapes = {
            key: {"clearance_mm": round(1e3 * r.clearance, 3), "nearest": r.nearest}
            for key, r in reports.items()
            if r.nearest
        }
        print(jsons.dumps({"scenario": cell.name, "ok": True, "shapes": shapes}))
        return 0
    print(f"{scenario} is in order: {cell.description or cell.name}")
    for key, report in reports.items():
        near = (
            f"{1e3 * report.clearance:.1f} mm from {report.nearest}" if report.nearest else "free"
        )
        print(f"  {key}: {near}")
    return 0
