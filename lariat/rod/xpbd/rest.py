"""Equilibria of the position-based rod: heavily damped steps until none moves it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import statics
from lariat.rod.state import Rest, RodState

if TYPE_CHECKING:
    from lariat.rod.xpbd.rod import XpbdRod

STILL = 1e-9
"""Movement in a step, relative to length, below which the rod counts as at rest [-]."""
EVERY = 100
"""Steps between two looks at whether it moves."""
MOST_STEPS = 10000
KEPT = 0.85
"""Share of its velocity that a step keeps: slow modes come home, nothing swings."""


def rest(
    rod: XpbdRod,
    left: Pose,
    right: Pose,
    guess: RodState | None,
    obstacles: Float64[np.ndarray, "m 12"] | None,
    dt: float,
) -> Rest:
    """See `XpbdRod.rest`."""
    statics.check_reach(rod, left, right)
    lost = min(1.0 - KEPT ** (1.0 / dt), 1.0 - 1e-15)
    damped = replace(rod.properties, linear_damping=lost, angular_damping=lost)
    calm = rod.with_properties(damped)
    if guess is not None:
        state = guess.at_rest()
    elif "free" in (rod.left, rod.right):
        state = statics.straight_from(rod, left, right)
    else:
        state = statics.between_grips(rod, left, right)
    actions = _approach(state, left, right, dt)
    moved = np.inf
    for _ in range(MOST_STEPS // EVERY):
        rolled = calm.rollout(state, actions, dt, steps=EVERY, obstacles=obstacles)
        state, actions = rolled.final, np.zeros((1, 2, 6))
        moved = float(np.max(np.abs(rolled.positions[-1] - rolled.positions[-2])))
        if not moved > STILL * rod.properties.length:
            break
    converged = moved <= STILL * rod.properties.length
    # What comes to rest out of motion is stable.
    return Rest(state.at_rest(), converged, converged, moved)


def _approach(state: RodState, left: Pose, right: Pose, dt: float) -> Float64[np.ndarray, "K 2 6"]:
    """Velocities that bring the grips of a guess to where they should be, then none."""
    actions = np.zeros((EVERY, 2, 6))
    for end, (pose, node, edge) in enumerate(((left, 0, 0), (right, -1, -1))):
        way = pose.position - state.positions[node]
        turn = poses.multiply(pose.orientation, poses.conjugate(state.orientations[edge]))
        actions[:-1, end, :3] = way / ((EVERY - 1) * dt)
        actions[:-1, end, 3:] = poses.logarithm(turn) / ((EVERY - 1) * dt)
    return actions
