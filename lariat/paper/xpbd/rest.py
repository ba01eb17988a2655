"""Equilibria of the position-based rod: heavily damped steps until none moves it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.paper.xpbd.model import XpbdRodModel
from lariat.paper.xpbd.properties import XpbdProperties
from lariat.rod.initial_shapes import between_grips, check_reach, straight_from_grip
from lariat.rod.results import Rest, Rollout
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.state import RodState

Simulate = Callable[[RolloutSpec[RodState]], Rollout]
"""`XpbdRod.rollout` of a heavily damped rod."""

REST_TOLERANCE = 1e-9
"""Displacement in a step, relative to the length, below which the rod is at rest [-]."""
STEPS_PER_CHECK = 100
"""Steps between two checks of the displacement."""
MAX_STEPS = 10000
"""Steps after which the search has failed."""
VELOCITY_RETENTION = 0.85
"""Share of its velocity that a step keeps: slow modes decay, nothing swings [-]."""


def heavily_damped(properties: XpbdProperties, dt: float) -> XpbdProperties:
    """Return properties whose damping leaves `VELOCITY_RETENTION` of the velocity after dt [s]."""
    lost = min(1.0 - VELOCITY_RETENTION ** (1.0 / dt), 1.0 - 1e-15)
    return replace(properties, linear_damping=lost, angular_damping=lost)


def find_rest(
    model: XpbdRodModel,
    simulate: Simulate,
    left: Pose,
    right: Pose,
    guess: RodState | None,
    obstacles: Float64[np.ndarray, "m 13"] | None,
    dt: float,
) -> Rest:
    """Find an equilibrium between two grips; see `XpbdRod.rest`.

    Args:
        model: Rod whose equilibrium is searched.
        simulate: Roll-out of that rod, heavily damped.
        left: Left grip.
        right: Right grip.
        guess: Shape to start from; None for a curve that sags along gravity.
        obstacles: Obstacles from `lariat.geometry.pack`.
        dt: Duration of a step [s].

    Raises:
        ValueError: The grips are farther apart than the rod between them is long.
    """
    check_reach(model, left, right)
    if guess is not None:
        state = guess.at_rest()
    elif "free" in (model.left, model.right):
        state = straight_from_grip(model, left, right)
    else:
        state = between_grips(model, left, right)
    actions = _approach(state, left, right, dt)
    moved = np.inf
    for _ in range(MAX_STEPS // STEPS_PER_CHECK):
        rollout = simulate(
            RolloutSpec(state, actions, dt, steps=STEPS_PER_CHECK, obstacles=obstacles)
        )
        state, actions = rollout.final, np.zeros((1, 2, 6))
        moved = float(np.max(np.abs(rollout.positions[-1] - rollout.positions[-2])))
        if not moved > REST_TOLERANCE * model.properties.length:
            break
    converged = moved <= REST_TOLERANCE * model.properties.length
    # A shape that motion comes to rest in is stable.
    return Rest(state.at_rest(), converged, converged, moved)


def _approach(state: RodState, left: Pose, right: Pose, dt: float) -> Float64[np.ndarray, "K 2 6"]:
    """Return velocities that move the grips of a guess to the wanted ones, then none."""
    actions = np.zeros((STEPS_PER_CHECK, 2, 6))
    for end, (pose, node, edge) in enumerate(((left, 0, 0), (right, -1, -1))):
        displacement = pose.position - state.positions[node]
        turn = poses.multiply(pose.orientation, poses.conjugate(state.orientations[edge]))
        actions[:-1, end, :3] = displacement / ((STEPS_PER_CHECK - 1) * dt)
        actions[:-1, end, 3:] = poses.logarithm(turn) / ((STEPS_PER_CHECK - 1) * dt)
    return actions
