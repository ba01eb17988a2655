"""`lariat goal`: a new goal for a running stack."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from cli.task import LOCAL, CellOptions, print_state
from lariat.configuration import ConfigurationError
from lariat.scenario import Rope, Scenario, Shape, load
from shared.messages import TaskRequest, goal_message
from stack.client import connect
from stack.live_goal import live_goal

Coordinates = tuple[float, float, float, float, float, float]
"""x, y, z of the left and of the right grip [m]."""


def main(
    file: Annotated[Path | None, tyro.conf.Positional] = None,
    /,
    line: Coordinates | None = None,
    json: bool = False,
    cell: CellOptions = LOCAL,
) -> int:
    """Set the goal: a scenario's, a chain of nodes, or the rope at rest between two grips.

    Examples:
      lariat goal three-cylinders
      lariat goal shape.csv
      lariat goal --line -0.17 0.15 0.22 0.17 0.15 0.24

    Args:
        file: A scenario's file or short name (its goal is taken), or a CSV of x, y, z [m] in each
            row, left end first.
        line: x, y, z of the left and of the right grip [m]; the rope hangs at rest between them.
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    if (file is None) == (line is None):
        raise ConfigurationError("give either a FILE or --line X Y Z X Y Z; see lariat goal --help")
    scenario = _scenario(file, line)
    scenario.grips(scenario.goal)  # Reads the goal's file: bad input ends here, before the bus.
    with connect(cell) as client:
        state = client.request_task(
            TaskRequest.SET_GOAL, goal=goal_message(live_goal(scenario, scenario.goal, client))
        )
    print_state(state, json)
    return 0


def _scenario(file: Path | None, line: Coordinates | None) -> Scenario:
    """Scenario with the wanted goal; its other values are not used."""
    named = file is not None and not file.suffix and not file.is_file()
    if file and (named or file.suffix == ".toml"):
        return load(file)
    if file:
        shape = Shape(nodes=file.name)
    else:
        assert line is not None
        shape = Shape(line=(line[:3], line[3:]))
    folder = file.parent if file else Path()
    return Scenario("goal", Rope(length=1.0, diameter=0.01), start=shape, goal=shape, folder=folder)
