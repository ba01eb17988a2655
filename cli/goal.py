"""`lariat goal`: a new goal for a running stack."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import tyro

from cli.task import LOCAL, CellOptions, JsonOption, print_state
from lariat.configuration import ConfigurationError, refusing
from lariat.files.bounded_file import read_file
from lariat.scenario import Goal, Rope, Scenario, Shape, load
from lariat.scenario.goal_table import read_goal
from lariat.scenario.scenario import MAX_NODES_FILE_SIZE
from shared.messages import TaskRequest, goal_message
from stack.client import connect
from stack.live_goal import live_goal

Coordinates = tuple[float, float, float, float, float, float]
"""x, y, z of the left and of the right grip [m]."""


def main(
    file: Annotated[Path | None, tyro.conf.Positional] = None,
    /,
    line: Coordinates | None = None,
    scale: float = 1.0,
    json: JsonOption = False,
    cell: CellOptions = LOCAL,
) -> int:
    """Set the goal: a scenario's, a chain of nodes, or the rope at rest between two grips.

    Examples:
      lariat goal three-cylinders
      lariat goal shape.csv
      lariat goal shape-in-millimetres.csv --scale 0.001
      lariat goal --line -0.17 0.15 0.22 0.17 0.15 0.24

    Args:
        file: A scenario's file or short name (its goal is taken), or a table of x, y, z [m] in
            each row, left end first, as a spreadsheet or the page writes it.
        line: x, y, z of the left and of the right grip [m]; the rope hangs at rest between them.
        scale: Factor of the table's numbers; 0.001 for millimetres.
    """
    if (file is None) == (line is None):
        raise ConfigurationError("give either a FILE or --line X Y Z X Y Z; see lariat goal --help")
    # Bad input ends here, before the bus.
    source = _goal(file, scale) if file else _between_grips(line)
    with connect(cell) as client:
        goal = source if isinstance(source, Goal) else live_goal(source, source.goal, client)
        state = client.request_task(TaskRequest.SET_GOAL, goal=goal_message(goal))
    count = len(state.goal.positions) // 3
    if isinstance(source, Goal) and len(source.nodes) != count:
        print(f"{len(source.nodes)} rows resampled to {count} nodes", file=sys.stderr)
    print_state(state, json)
    return 0


def _goal(file: Path, scale: float) -> Goal | Scenario:
    """Goal of a table, or the scenario whose goal is wanted."""
    if file.suffix == ".toml" or not (file.suffix or file.is_file()):
        if scale != 1.0:
            raise ConfigurationError(f"--scale {scale:g} is that of a table; set goal.scale")
        scenario = load(file)
        scenario.grips(scenario.goal)
        return scenario
    with refusing(f"cannot read nodes {file}"):
        return read_goal(read_file(file, MAX_NODES_FILE_SIZE), scale)


def _between_grips(line: Coordinates | None) -> Scenario:
    """Scenario with the wanted goal; its other values are not used."""
    assert line is not None
    shape = Shape(line=(line[:3], line[3:]))
    return Scenario("goal", Rope(length=1.0, diameter=0.01), start=shape, goal=shape)
