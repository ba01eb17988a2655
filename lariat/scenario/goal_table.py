"""Tables of nodes: x, y, z in each row, from the left end of the rope to the right.

A saved goal is such a table below the goal as a scenario's file gives it:

    # Goal arch of the scenario three-cylinders
    # goal = {nodes = "arch.csv", part = [0.1, 0.3]}
    # x, y, z [m]
    -0.150000,0.200000,0.300000
    ...

The second line, copied into a scenario beside the table, is this goal there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.configuration import ConfigurationError, read
from lariat.files.table import decode_text, read_table
from lariat.files.toml_text import parse_toml
from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.scenario.entries import inline
from lariat.scenario.sections import SIDES, Goal, Quaternion, Shape

GOAL_LINE = "# goal = "
"""Begin of the line with the goal."""
MIN_ROW_COUNT = 3
"""Fewest rows that make a shape."""
MAX_COORDINATE = 100.0
"""Largest coordinate of a node [m]."""
MILLIMETERS = 300.0
"""Length of a shape in lengths of its rope above which its numbers are taken for millimetres."""
SCALE_HINT = "are its numbers millimetres? Then give scale = 0.001 (--scale 0.001 on the command)"
"""Way out of a table in millimetres."""
LEVEL_GRIP = np.array([0.5, 0.5, 0.5, 0.5])
"""Orientation of a grip that points along the world's x: grip x, y, z are world y, z, x."""


def read_nodes(content: bytes, scale: float = 1.0) -> Float64[np.ndarray, "n 3"]:
    """Return the nodes of a table [m], in whatever form `lariat.files.table` reads.

    Args:
        content: The file.
        scale: Factor of its numbers; 0.001 for millimetres.

    Raises:
        ValueError: It holds no chain of nodes; the text names the row.
    """
    table = read_table(content)
    nodes = table.columns("x", "y", "z")
    for line, node in zip(table.lines, nodes, strict=True):
        if not np.isfinite(node).all():
            raise ValueError(f"line {line} is not finite; give every node a place")
    return checked_nodes(scale * nodes)


def checked_nodes(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n 3"]:
    """Return nodes that make a shape.

    Raises:
        ValueError: They make none.
    """
    if len(nodes) < MIN_ROW_COUNT:
        raise ValueError(
            f"{len(nodes)} rows of numbers; give at least {MIN_ROW_COUNT} rows of x, y, z [m]"
        )
    if not np.max(np.abs(nodes)) <= MAX_COORDINATE:
        raise ValueError(f"a number is not finite, or beyond ±{MAX_COORDINATE:g} m; {SCALE_HINT}")
    if polylines.length(nodes) <= 0.0:
        raise ValueError("all nodes are the same point")
    return nodes


def length_fault(nodes: Float64[np.ndarray, "n 3"], rope_length: float, tolerance: float) -> str:
    """Return in words how the length of a shape differs from its rope's; empty where it does not.

    Args:
        nodes: Nodes of the shape [m].
        rope_length: Length of the rope [m].
        tolerance: Largest difference, relative to the rope's length [-].
    """
    length = polylines.length(nodes)
    if abs(length - rope_length) <= tolerance * rope_length:
        return ""
    in_millimeters = length > MILLIMETERS * rope_length
    hint = SCALE_HINT if in_millimeters else "scale the shape or correct rope.length"
    return f"{length:.4f} m long, the rope {rope_length:g} m; {hint}"


def grip_orientation(
    direction: np.ndarray, orientation: Quaternion | None = None
) -> Float64[np.ndarray, "4"]:
    """Return the orientation of a grip: the given one, else along the rope by the least rotation.

    Args:
        direction: Unit vector along the rope, from the left to the right.
        orientation: Orientation; None for that along the rope.
    """
    if orientation is not None:
        return poses.normalized(np.array(orientation))
    return poses.multiply(poses.rotation_between(np.array([1.0, 0.0, 0.0]), direction), LEVEL_GRIP)


def read_goal(content: bytes, scale: float = 1.0) -> Goal:
    """Return the goal of a table: its nodes, the grips that hold them, and what of it counts.

    Raises:
        ValueError: The table holds no chain of nodes, or its line with the goal is none.
    """
    nodes = read_nodes(content, scale)
    shape = read_entry(decode_text(content)) or Shape(nodes=nodes)
    ends = nodes[[0, -1]] if shape.line is None else np.array(shape.line)
    orientations = shape.left_orientation, shape.right_orientation
    left, right = (
        Pose(position, grip_orientation(tangent, orientation))
        for position, tangent, orientation in zip(
            ends, polylines.end_tangents(nodes), orientations, strict=True
        )
    )
    goal = Goal(nodes, left, right, **shape.terms)
    if shape.part is not None:
        return goal
    oriented = [orientation is not None for orientation in orientations]
    return replace(goal, left_oriented=oriented[0], right_oriented=oriented[1])


def goal_table(goal: Goal, name: str, scenario: str) -> str:
    """Return the text of a goal's table.

    Args:
        goal: The goal.
        name: Its name, and that of the file without `.csv`.
        scenario: Name of its scenario.
    """
    # The grips of a part's goal are those of one shape of many whose part is this.
    oriented = [s for s, fixed in zip(SIDES, goal.oriented, strict=True) if fixed and not goal.part]
    entry = goal.entry(oriented, f"{name}.csv")
    rows = "".join(f"{x:.6f},{y:.6f},{z:.6f}\n" for x, y, z in goal.nodes)
    return (
        f"# Goal {name} of the scenario {scenario}\n"
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
