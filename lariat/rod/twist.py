"""Whole turns of twist in a rod: counting them and adding them.

Nodes and end frames determine the twist up to whole turns. Turns are counted from the state that
`state_along` returns, which has at most half a turn; they are positive if the right end is rotated
against the left one about the rod's axis, which points from left to right.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod.initial_shapes import EDGE_AXIS, state_along
from lariat.rod.state import RodState


def count_turns(state: RodState) -> int:
    """Return the number of whole turns of twist in a rod [-].

    Raises:
        ValueError: Only one of the ends is clamped.
    """
    x, q = state.positions, state.orientations
    if len(q) - len(x) + 1 == 1:
        raise ValueError("turns are counted between two ends of the same kind, not one clamp")
    least = state_along(x, q[0], q[-1], (1, 1) if len(q) > len(x) else (0, 0))
    difference = _twist(state.orientations) - _twist(least.orientations)
    return round(difference / (2.0 * np.pi))


def add_turns(state: RodState, count: float) -> RodState:
    """Return the same shape with turns of twist added, spread evenly along the rod.

    Whole turns leave the orientations of both ends as they are.

    Args:
        state: State to start from.
        count: Turns to add, of either sign [-].
    """
    edges = len(state.positions) - 1
    clamps = len(state.orientations) - edges
    # Evenly over the arc length: a clamp lies half an edge beyond the middle of the outermost edge.
    steps = np.ones(len(state.orientations) - 1)
    if clamps == 2:
        steps[[0, -1]] = 0.5
    angles = 2.0 * np.pi * count * np.concatenate([[0.0], np.cumsum(steps) / np.sum(steps)])
    spun = poses.multiply(state.orientations, poses.exponential(angles[:, None] * EDGE_AXIS))
    return RodState(state.positions, spun, state.velocities, state.angular_velocities)


def _twist(orientations: Float64[np.ndarray, "e 4"]) -> float:
    """Return the sum of the twist angles between neighbouring edges [rad]."""
    steps = poses.multiply(poses.conjugate(orientations[:-1]), orientations[1:])
    # Swing-twist decomposition: the rotation about the axis is by twice this angle.
    angles = 2.0 * np.arctan2(steps[:, 3], steps[:, 0])
    return float(np.sum(np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi))
