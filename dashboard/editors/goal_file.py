"""Goal shapes from CSV files: x, y, z [m] in each row, from the left end to the right."""

from __future__ import annotations

import io

import numpy as np

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from shared.messages import Goal, grip
from shared.scenario import Scenario
from shared.scenario.scenario import LEVEL_GRIP

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
        ValueError: The file holds no chain of nodes, or one of another length than the rope.
    """
    try:
        nodes = np.loadtxt(io.BytesIO(content), delimiter=",", comments="#", ndmin=2)
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"no numbers in rows of x, y, z [m]: {error}") from error
    if nodes.shape[1] != 3 or len(nodes) < MIN_ROW_COUNT or not np.all(np.isfinite(nodes)):
        raise ValueError(
            f"{nodes.shape[0]} rows of {nodes.shape[1]} numbers; "
            f"give at least {MIN_ROW_COUNT} rows of x, y, z [m]"
        )
    length, rope_length = polylines.length(nodes), scenario.rope.length
    if abs(length - rope_length) > LENGTH_TOLERANCE * rope_length:
        raise ValueError(
            f"the shape is {length:.4f} m long, the rope {rope_length} m; scale the shape"
        )
    nodes = polylines.resample_smooth(nodes, scenario.rope.node_count)
    first, last = polylines.end_tangents(nodes)
    return Goal(
        positions=nodes.ravel(),
        left=grip(Pose(nodes[0], _grip_orientation(first))),
        right=grip(Pose(nodes[-1], _grip_orientation(last))),
    )


def _grip_orientation(unit: np.ndarray) -> np.ndarray:
    """Orientation of a grip whose z axis lies along the rope, as scenarios define it."""
    return poses.multiply(poses.rotation_between(np.array([1.0, 0.0, 0.0]), unit), LEVEL_GRIP)
