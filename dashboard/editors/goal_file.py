"""Goal shapes from CSV files: x, y, z [m] in each row, from the left end to the right.

Columns are separated by commas, by semicolons (decimals may then have a comma) or by white space. A
first row of names is skipped, and so is what follows a #, except that a saved goal says in such a
line what of it counts ([shared/goal_table.py](../../shared/goal_table.py)).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.scenario import Goal, Scenario, Shape
from lariat.scenario.checks import check_part
from lariat.scenario.scenario import LEVEL_GRIP
from shared.goal_table import read_entry
from shared.messages import goal_message
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
        nodes,
        Pose(nodes[0], _grip_orientation(first)),
        Pose(nodes[-1], _grip_orientation(last)),
    )
    shape = read_entry(text)
    return goal if shape is None else _counting(goal, shape, scenario)


def _counting(goal: Goal, shape: Shape, scenario: Scenario) -> Goal:
    """Goal that counts as a shape says: its terms, the grips of its ends, orientations.

    Raises:
        ValueError: This rope does not have the part.
    """
    goal = replace(goal, **shape.terms)
    if shape.part is not None:
        check_part(scenario, "goal", shape.part)
        check_goal(goal_message(goal))
        return goal
    grips, given = goal.grips, (shape.left_orientation, shape.right_orientation)
    if shape.line is not None:
        grips = scenario.grips(shape)
    left, right = (
        grip if orientation is None else Pose(grip.position, np.array(orientation))
        for grip, orientation in zip(grips, given, strict=True)
    )
    return replace(
        goal,
        left=left,
        right=right,
        left_oriented=given[0] is not None,
        right_oriented=given[1] is not None,
    )


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
