"""Goals as CSV tables: the nodes of the whole rope, below the goal as a scenario's file gives it.

    # Goal arch of the scenario three-cylinders
    # goal = {nodes = "arch.csv", part = [0.1, 0.3]}
    # x, y, z [m]
    -0.150000,0.200000,0.300000
    ...

The second line, copied into a scenario beside the table, is this goal there.
"""

from __future__ import annotations

import tomllib
from typing import Any

from lariat.configuration import ConfigurationError, read
from lariat.scenario.entries import inline, numbers
from lariat.scenario.sections import SIDES, Shape
from shared.messages import Goal, SavedGoal, chain

GOAL_LINE = "# goal = "
"""Begin of the line with the goal."""


def goal_table(saved: SavedGoal) -> str:
    """Return the text of a goal's table.

    Args:
        saved: Goal with nodes.
    """
    file = f"{saved.name}.csv"
    rows = "".join(f"{x:.6f},{y:.6f},{z:.6f}\n" for x, y, z in chain(saved.goal.positions))
    return (
        f"# Goal {saved.name} of the scenario {saved.scenario}\n"
        f"{GOAL_LINE}{inline(goal_entry(saved.goal, file))}\n"
        f"# x, y, z [m]\n{rows}"
    )


def goal_entry(goal: Goal, file: str) -> dict[str, Any]:
    """Return the `[goal]` of a scenario.

    Args:
        goal: The goal.
        file: Name of the table with its nodes.
    """
    grips = dict(zip(SIDES, (goal.left, goal.right), strict=True))
    oriented = dict(zip(SIDES, (goal.left_oriented, goal.right_oriented), strict=True))
    entry: dict[str, Any] = {"nodes": file}
    if goal.ends_only:
        entry = {"line": [numbers(grip.position) for grip in grips.values()], "ends_only": True}
    if goal.part:
        entry["part"] = numbers(goal.part)
    else:
        entry |= {
            f"{side}_orientation": numbers(grips[side].orientation)
            for side in SIDES
            if oriented[side]
        }
    return entry | ({"turns": goal.turns} if goal.turns else {})


def read_entry(text: str) -> Shape | None:
    """Return the goal that the lines above a table give; None where none of them does.

    Args:
        text: Text of the table.

    Raises:
        ValueError: Such a line is no goal.
    """
    line = next((each for each in text.splitlines() if each.startswith(GOAL_LINE)), None)
    if line is None:
        return None
    try:
        entry = tomllib.loads(line.removeprefix("# "))["goal"]
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{line[:60]!r} is no goal: {error}") from None
    if not isinstance(entry, dict):
        raise ConfigurationError(f"{line[:60]!r} is no table of a goal")
    return read(Shape, entry, "goal")
