"""Goal shapes from CSV files: x, y, z [m] in each row, from the left end to the right.

Columns are separated by commas, by semicolons (decimals may then have a comma) or by white space. A
first row of names is skipped, and so is what follows a #, except that a saved goal says in such a
line what of it counts ([shared/goal_table.py](../../shared/goal_table.py)).
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.scenario import Scenario, Shape
from lariat.scenario.checks import check_part
from lariat.scenario.scenario import LEVEL_GRIP
from shared.goal_table import read_entry
from shared.messages import Goal, grip
from shared.messages.checks.task import check_goal

LENGTH_TOLERANCE = 0.03
"""Largest difference between the lengths of shape and rope, relative to the rope's [-]."""
MIN_ROW_COUNT = 3
"""Fewest rows that make a shape."""


def parse(content: bytes, scenario: Scenario) -> Goal:
    """Read a goal: nodes, resampled to the rope's count, and the grips that hold them.

    Args:
        content: The file.
        scenario: Rope that must take the shape.

    Raises:
        ValueError: The file holds no chain of nodes, one of another length than the rope, or a
            part that this rope does not have.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("it is no text; give rows of x, y, z [m]") from None
    nodes = fitting_nodes(_read_rows(text), scenario)
    first, last = polylines.end_tangents(nodes)
    goal = Goal(
        positions=nodes.ravel(),
        left=grip(Pose(nodes[0], _grip_orientation(first))),
        right=grip(Pose(nodes[-1], _grip_orientation(last))),
    )
    shape = read_entry(text)
    if shape is not None:
        _take_shape(goal, shape, scenario)
    return goal


def _take_shape(goal: Goal, shape: Shape, scenario: Scenario) -> None:
    """Let a goal count as a shape says: its part, its ends alone, orientations and turns.

    Raises:
        ValueError: This rope does not have the part.
    """
    goal.turns, goal.ends_only = shape.turns, shape.ends_only
    if shape.part is not None:
        check_part(scenario, "goal", shape.part)
        goal.part[:] = shape.part
        check_goal(goal)
        return
    if shape.ends_only:
        left, right = scenario.grips(shape)
        goal.left.CopyFrom(grip(left))
        goal.right.CopyFrom(grip(right))
    if shape.left_orientation is not None:
        goal.left.orientation[:] = shape.left_orientation
    if shape.right_orientation is not None:
        goal.right.orientation[:] = shape.right_orientation
    goal.left_oriented = shape.left_orientation is not None
    goal.right_oriented = shape.right_orientation is not None


def fitting_nodes(
    nodes: Float64[np.ndarray, "k 3"], scenario: Scenario
) -> Float64[np.ndarray, "n 3"]:
    """Return a shape with as many nodes as the rope has [m].

    Args:
        nodes: Nodes of the shape [m].
        scenario: Rope that must take the shape.

    Raises:
        ValueError: The shape is not as long as the rope.
    """
    length, rope_length = polylines.length(nodes), scenario.rope.length
    if abs(length - rope_length) > LENGTH_TOLERANCE * rope_length:
        unit = "; are its numbers millimetres?" if length > 100.0 * rope_length else ""
        raise ValueError(
            f"the shape is {length:.4f} m long, the rope {rope_length} m; scale the shape{unit}"
        )
    if len(nodes) == scenario.rope.node_count:
        return nodes
    return polylines.resample_smooth(nodes, scenario.rope.node_count)


def _read_rows(text: str) -> Float64[np.ndarray, "n 3"]:
    """Read rows of three numbers.

    Raises:
        ValueError: A row is no such row; the message names it.
    """
    rows: list[list[float]] = []
    named = False
    for number, line in enumerate(text.splitlines(), start=1):
        row_text = line.partition("#")[0].strip()
        if not row_text:
            continue
        cells = [cell.strip(' "') for cell in _split(row_text)]
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            if not rows and not named:
                named = True
                continue
            raise ValueError(f"line {number}: {row_text[:60]!r} is not x, y, z [m]") from None
        if len(row) != 3:
            raise ValueError(f"line {number}: {len(row)} numbers instead of x, y, z [m]")
        if not all(math.isfinite(value) for value in row):
            raise ValueError(
                f"line {number}: {row_text[:60]!r} is not finite; give every node a place"
            )
        rows.append(row)
    if len(rows) < MIN_ROW_COUNT:
        raise ValueError(
            f"{len(rows)} rows of numbers; give at least {MIN_ROW_COUNT} rows of x, y, z [m]"
        )
    return np.array(rows)


def _split(row: str) -> list[str]:
    if ";" in row:
        return row.replace(",", ".").split(";")
    return row.split(",") if "," in row else row.split()


def _grip_orientation(unit: np.ndarray) -> np.ndarray:
    """Orientation of a grip whose z axis lies along the rope, as scenarios define it."""
    return poses.multiply(poses.rotation_between(np.array([1.0, 0.0, 0.0]), unit), LEVEL_GRIP)
