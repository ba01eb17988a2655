"""Whole turns of twist in a rod: how many there are, and putting them in.

The same nodes between the same end frames leave the twist open by whole turns. Turns are counted
from the state that `framed` makes, which has at most half a turn; they are positive where the right
end is turned about the rope's own axis, from left to right, against the left one.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod.state import RodState
from lariat.rod.statics import framed

AXIS = np.array([0.0, 0.0, 1.0])


def turns(state: RodState) -> int:
    """Whole turns in a rod."""
    least = framed(state.positions, state.orientations[0], state.orientations[-1])
    difference = _twist(state.orientations) - _twist(least.orientations)
    return round(difference / (2.0 * np.pi))


def wound(state: RodState, count: float) -> RodState:
    """The same shape with turns added, spread evenly; whole turns leave its ends as they are."""
    angles = 2.0 * np.pi * count * np.linspace(0.0, 1.0, len(state.orientations))
    spun = poses.multiply(state.orientations, poses.exponential(angles[:, None] * AXIS))
    return RodState(state.positions, spun, state.velocities, state.angular_velocities)


def _twist(orientations: Float64[np.ndarray, "e 4"]) -> float:
    """Sum of the turns of each edge against the one before, about the rope's axis [rad]."""
    steps = poses.multiply(poses.conjugate(orientations[:-1]), orientations[1:])
    # Swing and twist: the part of a rotation about one axis is twice this angle.
    angles = 2.0 * np.arctan2(steps[:, 3], steps[:, 0])
    return float(np.sum(np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi))
