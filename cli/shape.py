"""`lariat shape`: rest shape of a scenario's true rope, as a goal for a scenario."""

from __future__ import annotations

import json as jsons
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines
from lariat.scenario.settings import load_with
from lariat.simulation.rest_shape import rest_shape, write_nodes


def main(
    scenario: tyro.conf.Positional[Path],
    /,
    output: Path,
    left: tuple[float, float, float] | None = None,
    right: tuple[float, float, float] | None = None,
    json: bool = False,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
) -> int:
    """Write the rest shape of a scenario's true rope between two grips, as nodes of a goal.

    The rope is the simulated one: of `[plant.rope]`, finer than the controller's, and held as
    `[plant.grips]` says, and wound by the goal's turns. The grips have the orientations of the
    scenario's goal, or of its start where an end does not rotate.

    Examples:
      lariat shape rope --right 0.14 0.12 0.20 --output scenarios/goals/rope-1.csv
      lariat shape my-cell.toml --output goal.csv --set plant.model=links

    Args:
        scenario: The scenario's TOML file, or the short name of a shipped one.
        output: CSV file to write: x, y, z [m] in each row, left end first.
        left: Position of the left grip [m]; by default the goal's.
        right: Position of the right grip [m]; by default the goal's.
        json: Answer with one JSON object on standard output.
        set: Replaces one value of the scenario; may be repeated.

    Returns:
        0 when the file is written.
    """
    cell = load_with(scenario, set)
    nodes = rest_shape(
        cell,
        None if left is None else np.array(left),
        None if right is None else np.array(right),
    )
    grips = " ".join(f"--{s} {' '.join(map(str, p))}" for s, p in _given(left, right))
    changes = "".join(f" --set {change}" for change in set)
    options = f" {grips}" if grips else ""
    origin = f"lariat shape {scenario}{options}{changes} --output {output}"
    write_nodes(output, nodes, f"Rest shape of the simulated rope, by: {origin}")
    solids = [body for body in cell.bodies if not body.support]
    clearance = geometry.chain_clearance(nodes, cell.plant_rope.diameter / 2.0, solids)
    if json:
        answer = {
            "file": str(output),
            "node_count": len(nodes),
            "length": round(polylines.length(nodes), 6),
            "clearance_mm": round(1e3 * clearance, 3) if solids else None,
        }
        print(jsons.dumps(answer))
        return 0
    near = f", {1e3 * clearance:.1f} mm from the nearest obstacle" if solids else ""
    print(f"wrote {len(nodes)} nodes to {output}{near}")
    return 0


def _given(
    left: tuple[float, float, float] | None, right: tuple[float, float, float] | None
) -> list[tuple[str, tuple[float, float, float]]]:
    """Sides whose grip is given, with its position [m]."""
    return [(s, p) for s, p in (("left", left), ("right", right)) if p is not None]
