"""A goal shape from a CSV file: x, y, z [m] in each row, from the left end to the right."""

from __future__ import annotations

import io

import numpy as np

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from shared.messages import Goal, grip
from shared.scenario import Scenario
from shared.scenario.scenario import LEVEL


def parse(content: bytes, scenario: Scenario) -> Goal:
    """The goal of a file, with as many nodes as the rope has and the grips that hold it.

    Raises:
        ValueError: The file holds no chain, or not one of the rope's length.
    """
    try:
        nodes = np.loadtxt(io.BytesIO(content), delimiter=",", comments="#", ndmin=2)
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"no numbers in rows of x, y, z [m]: {error}") from error
    if nodes.shape[1] != 3 or len(nodes) < 3 or not np.all(np.isfinite(nodes)):
        raise ValueError(
            f"{nodes.shape[0]} rows of {nodes.shape[1]} numbers; "
            "give at least 3 rows of x, y, z [m]"
        )
    length, wanted = polylines.length(nodes), scenario.rope.length
    if abs(length - wanted) > 0.03 * wanted:
        raise ValueError(f"the shape is {length:.4f} m long, the rope {wanted} m; scale the shape")
    nodes = polylines.resampled(nodes, scenario.rope.node_count)
    return Goal(
        positions=nodes.ravel(),
        left=grip(Pose(nodes[0], _along(nodes[1] - nodes[0]))),
        right=grip(Pose(nodes[-1], _along(nodes[-1] - nodes[-2]))),
    )


def _along(direction: np.ndarray) -> np.ndarray:
    """The grip that points along the rope, as scenarios define it."""
    unit = poses.normalized(direction)
    return poses.multiply(poses.between(np.array([1.0, 0.0, 0.0]), unit), LEVEL)
