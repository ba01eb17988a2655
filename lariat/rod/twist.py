"""Whole turns of twist in a rod: counting them and adding them.

Nodes and end frames determine the twist up to whole turns. Turns are counted from the state that
`state_along` returns, which has at most half a turn; they are positive if the right end is rotated
against the left one about the rod's axis, which points from left to right.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod.initial_shapes import EDGE_AXIS, tangents
from lariat.rod.state import RodState

BENDING_STEPS = 16
"""Number of steps in which a rod is led into another shape while its twist is followed."""


def count_turns(state: RodState) -> int:
    """Return the number of whole turns of twist in a rod [-].

    Raises:
        ValueError: Only one of the ends is clamped.
    """
    q = state.orientations
    return _turns_beyond(_least_twists(state.positions[None], q[0], q[-1])[0], state)


def count_turns_along(state: RodState, nodes: Float64[np.ndarray, "n 3"]) -> int:
    """Return the number of whole turns that a rod has once it has bent into another shape [-].

    While the ends do not turn, twist and writhe change into one another (Călugăreanu's theorem):
    a rod that throws a loop loses a turn of twist. The rod is led along straight lines from node
    to node, and its twist is followed; it is taken not to pass through itself on the way.

    Args:
        state: State of the rod, between two ends of the same kind.
        nodes: Nodes of the other shape [m].

    Raises:
        ValueError: Only one of the ends is clamped.
    """
    shares = np.linspace(0.0, 1.0, BENDING_STEPS + 1)[:, None, None]
    chains = (1.0 - shares) * state.positions + shares * nodes
    least = _least_twists(chains, state.orientations[0], state.orientations[-1])
    # The least twist wraps around at half a turn where the twist itself goes on.
    wraps = np.round(np.diff(least) / (2.0 * np.pi))
    return _turns_beyond(least[0], state) - int(np.sum(wraps))


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
    return replace(state, orientations=spun, contact=None)


def connected(first: RodState, last: RodState) -> bool:
    """Return whether a rod gets from one state to another while neither end is rotated.

    The frames along a rod are a curve in the space of rotations. With both of its ends held, such
    curves fall into two classes (the fundamental group of SO(3); Dirac's belt trick), between which
    a rod changes by an odd number of turns alone, on whatever side its parts pass one another. The
    orientations of its ends are the same in both states.
    """
    return float(np.dot(_lifted_rotation(first), _lifted_rotation(last))) > 0.0


def _lifted_rotation(state: RodState) -> Float64[np.ndarray, "4"]:
    """Rotation from the first to the last frame, continued along the rod as a quaternion."""
    q = state.orientations
    flips = np.sum(q[1:] * q[:-1], axis=1) < 0.0
    return poses.multiply(poses.conjugate(q[0]), q[-1]) * (-1.0) ** np.sum(flips)


def _turns_beyond(least: float, state: RodState) -> int:
    """Return the whole turns by which a rod is twisted more than its shape needs at least [rad]."""
    if len(state.orientations) - len(state.positions) + 1 == 1:
        raise ValueError("turns are counted between two ends of the same kind, not one clamp")
    return round((_twist(state.orientations) - least) / (2.0 * np.pi))


def _twist(orientations: Float64[np.ndarray, "e 4"]) -> float:
    """Return the sum of the twist angles between neighbouring edges [rad]."""
    steps = poses.multiply(poses.conjugate(orientations[:-1]), orientations[1:])
    # Swing-twist decomposition: the rotation about the axis is by twice this angle.
    angles = 2.0 * np.arctan2(steps[:, 3], steps[:, 0])
    return float(np.sum(np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi))


def _least_twists(
    chains: Float64[np.ndarray, "t n 3"],
    first: Float64[np.ndarray, "4"],
    last: Float64[np.ndarray, "4"],
) -> Float64[np.ndarray, "t"]:
    """Return the twist, at most half a turn, of chains between two end frames [rad].

    Args:
        chains: Nodes of each chain [m].
        first: Orientation of the left end.
        last: Orientation of the right end.
    """
    along = np.stack([tangents(nodes) for nodes in chains])
    frames = poses.multiply(
        poses.rotation_between(poses.rotate(first, EDGE_AXIS), along[:, 0]), first
    )
    steps = poses.rotation_between(along[:, :-1], along[:, 1:])
    # All products of neighbours at once, again and again: there are few rounds of them.
    while steps.shape[1] > 1:
        odd = steps[:, :1] if steps.shape[1] % 2 else steps[:, :0]
        rest = steps[:, odd.shape[1] :]
        steps = np.concatenate([odd, poses.multiply(rest[:, 1::2], rest[:, ::2])], axis=1)
    frames = poses.multiply(steps[:, 0], frames)
    ends = poses.multiply(poses.rotation_between(poses.rotate(last, EDGE_AXIS), along[:, -1]), last)
    return poses.logarithm(poses.multiply(poses.conjugate(frames), ends))[:, 2]
