"""Goals as CSV tables: the nodes of the whole rope, below the goal as a scenario's file gives it.

    # Goal arch of the scenario three-cylinders
    # goal = {nodes = "arch.csv", part = [0.1, 0.3]}
    # x, y, z [m]
    -0.150000,0.200000,0.300000
    ...

The second line, copied into a scenario beside the table, is this goal there.
"""

from __future__ import annotations

from lariat.configuration import ConfigurationError, read
from lariat.files.toml_text import parse_toml
from lariat.scenario.entries import inline
from lariat.scenario.sections import SIDES, Shape
from shared.messages import SavedGoal, goal_of

GOAL_LINE = "# goal = "
"""Begin of the line with the goal."""


def goal_table(saved: SavedGoal) -> str:
    """Return the text of a goal's table."""
    goal = goal_of(saved.goal)
    # The grips of a part's goal are those of one shape of many whose part is this.
    oriented = [s for s, given in zip(SIDES, goal.oriented, strict=True) if given and not goal.part]
    entry = goal.entry(oriented, f"{saved.name}.csv")
    rows = "".join(f"{x:.6f},{y:.6f},{z:.6f}\n" for x, y, z in goal.nodes)
    return (
        f"# Goal {saved.name} of the scenario {saved.scenario}\n"
        f"{GOAL_LINE}{inline(entry)}\n"
        f"# x, y, z [m]\n{rows}"
    )


def read_entry(text: str) -> Shape | None:
    """Return the goal that the lines above a table give; None where none of them does.

    Raises:
        ValueError: Such a line is no goal.
    """
    line = next((each for each in text.splitlines() if each.startswith(GOAL_LINE)), None)
    if line is None:
        return None
    try:
        entry = parse_toml(line.removeprefix("# "))["goal"]
    except ValueError as error:
        raise ValueError(f"{line[:60]!r} is no goal: {error}") from None
    if not isinstance(entry, dict):
        raise ConfigurationError(f"{line[:60]!r} is no table of a goal")
    return read(Shape, entry, "goal")
