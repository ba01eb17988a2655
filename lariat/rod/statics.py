"""Equilibria: a start of the right length between two grips, then steps of growing duration.

An implicit step without inertia is a proximal step that decreases the energy. Short steps are
robust far from the equilibrium; long ones are Newton's method on the statics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import SUPPORT_COLUMN, Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.rod.initial_shapes import (
    between_grips,
    check_reach,
    gravity_direction,
    straight_from_grip,
)
from lariat.rod.model import Dimensions, RodModel
from lariat.rod.obstacle_table import unpack
from lariat.rod.results import Rest, Rollout
from lariat.rod.state import RodState

Settle = Callable[
    [
        RodState,
        Float64[np.ndarray, "H 2 6"],
        Float64[np.ndarray, "H"],
        Float64[np.ndarray, "m 13"] | None,
    ],
    tuple[Rollout, bool],
]
"""`Rod.settle` of the rod whose equilibrium is searched."""

RELAXATION_DURATIONS = 0.02 * 1.7 ** np.arange(36)
"""Durations of the relaxation steps, from viscous creep to pure statics [s]."""
FALLING_STEPS = 8
"""Relaxation steps in which a rod falls from its start; later ones hardly move it."""
APPROACH_STEPS = 12
"""Steps over which the grips of a guess move to the wanted grips."""
MAX_OVERLAP = 0.25
"""Overlap with an obstacle above which a shape counts as caught inside it, in diameters [-]."""
MAX_REFINEMENTS = 4
"""Number of times that the steps are halved when the rod jumps over an obstacle in one of them."""
JUMP_STRIDE = 0.5
"""Distance between the places along a step at which it is checked for a jump, in diameters [-]."""
REST_TOLERANCE = 1e-6
"""Displacement in the last step, relative to the length, below which the rod is at rest [-]."""
PERTURBATION_SIZE = 0.02
"""Size of the perturbation that leaves a saddle point, relative to the length [-]."""


def find_rest(
    model: RodModel[Dimensions],
    settle: Settle,
    left: Pose,
    right: Pose,
    guess: RodState | None,
    obstacles: Float64[np.ndarray, "m 13"] | None,
) -> Rest:
    """Find an equilibrium between two grips; see `Rod.rest`.

    Args:
        model: Rod whose equilibrium is searched.
        settle: That rod's `settle`.
        left: Left grip.
        right: Right grip.
        guess: Shape to start from; None for a curve that sags along gravity.
        obstacles: Obstacles from `lariat.geometry.pack`.

    Raises:
        ValueError: The grips are farther apart than the rod between them is long.
    """
    check_reach(model, left, right)
    if guess is not None:
        start = guess.at_rest()
    elif "free" in (model.left, model.right):
        start = straight_from_grip(model, left, right)
    else:
        start = _collision_free_start(model, left, right, obstacles)
    equilibrium = _relax(model, settle, start, left, right, obstacles)
    if not equilibrium.stable or not equilibrium.converged:
        # A symmetric start can end on a saddle point, which a perturbation leaves.
        perturbed = _perturbed(model, equilibrium.state)
        perturbed = replace(perturbed, plastic_curvature=start.plastic_curvature)
        equilibrium = _relax(model, settle, perturbed, left, right, obstacles)
    if _clearance(model, equilibrium.state, obstacles) < -MAX_OVERLAP * model.properties.diameter:
        # Pushed out of the nearest face, a rod can end up pulled tight inside an obstacle.
        equilibrium = replace(equilibrium, converged=False)
    return equilibrium


def _clearance(
    model: RodModel[Dimensions], state: RodState, obstacles: Float64[np.ndarray, "m 13"] | None
) -> float:
    if obstacles is None:
        return np.inf
    return chain_clearance(state.positions, model.properties.diameter / 2.0, unpack(obstacles))


def _collision_free_start(
    model: RodModel[Dimensions],
    left: Pose,
    right: Pose,
    obstacles: Float64[np.ndarray, "m 13"] | None,
) -> RodState:
    """Return the sagging curve; if it collides, the similar one with the most clearance.

    With supports in the scene, the curve is raised above them, so that the rope is laid onto them.
    """
    start = between_grips(model, left, right)
    down = gravity_direction(model)
    if obstacles is not None and np.any(obstacles[:, SUPPORT_COLUMN]):
        depths = start.positions @ down
        lift = max(depths) - min(depths) + model.properties.diameter
        raised = replace(start, positions=start.positions - lift * down)
        if _clearance(model, raised, obstacles) > 0.0:
            return raised
    if _clearance(model, start, obstacles) > 0.0:
        return start
    chord = poses.normalized(right.position - left.position + np.array([1e-12, 0.0, 0.0]))
    side = np.cross(chord, down)
    candidates = [start]
    for direction in (-down, side, -side):
        if np.linalg.norm(direction) > 1e-3:
            candidates.append(between_grips(model, left, right, poses.normalized(direction)))
    return max(candidates, key=lambda state: _clearance(model, state, obstacles))


def _relax(
    model: RodModel[Dimensions],
    settle: Settle,
    start: RodState,
    left: Pose,
    right: Pose,
    obstacles: Float64[np.ndarray, "m 13"] | None,
) -> Rest:
    """Move the grips of a start to the wanted ones and let the rod come to rest.

    The steps are halved where a long one would carry the rod over a thin obstacle.
    """
    solids = [] if obstacles is None else unpack(obstacles)
    diameter = model.properties.diameter

    def relaxed(division: int) -> tuple[Rollout, bool]:
        approach, durations = _durations(division)
        actions = np.zeros((len(durations), 2, 6))
        for end, (pose, kind) in enumerate(((left, model.left), (right, model.right))):
            if kind == "free":
                continue
            q, p = start.orientations[-end], start.positions[-end]
            turn = poses.logarithm(poses.multiply(pose.orientation, poses.conjugate(q)))
            time = approach * durations[0]
            actions[:approach, end, :3] = (pose.position - p) / time
            actions[:approach, end, 3:] = turn / time
        return settle(start, actions, durations, obstacles)

    rollout, stable = relaxed(1)
    for refinement in range(MAX_REFINEMENTS):
        path = np.concatenate([start.positions[None], rollout.positions])
        if not _jumps(path, diameter, solids):
            break
        rollout, stable = relaxed(2 ** (refinement + 1))
    residual = float(np.max(np.abs(rollout.positions[-1] - rollout.positions[-2])))
    converged = bool(rollout.converged[-1]) and residual < REST_TOLERANCE * model.properties.length
    return Rest(rollout.final.at_rest(), converged, stable, residual)


def _durations(division: int) -> tuple[int, Float64[np.ndarray, "H"]]:
    """Return the number of approach steps, and the durations of all steps [s]."""
    first = np.full(APPROACH_STEPS, RELAXATION_DURATIONS[0])
    falling = np.concatenate([first, RELAXATION_DURATIONS[:FALLING_STEPS]])
    divided = np.repeat(falling / division, division)
    return division * APPROACH_STEPS, np.append(divided, RELAXATION_DURATIONS[FALLING_STEPS:])


def _jumps(
    path: Float64[np.ndarray, "t n 3"], diameter: float, obstacles: Sequence[Obstacle]
) -> bool:
    """Whether a rod is outside of an obstacle before and after a step, and inside it on the way.

    Args:
        path: Nodes before the first step and after each one [m].
        diameter: Diameter of the rod [m].
        obstacles: Obstacles of the scene.
    """
    if not obstacles:
        return False
    radius, moved = diameter / 2.0, np.linalg.norm(np.diff(path, axis=0), axis=2).max(axis=1)
    for k in np.flatnonzero(moved > diameter):
        ends = [chain_clearance(nodes, radius, obstacles) for nodes in path[k : k + 2]]
        if sum(ends) > moved[k]:
            continue
        shares = np.linspace(0.0, 1.0, 1 + math.ceil(moved[k] / (JUMP_STRIDE * diameter)))[1:-1]
        between = [path[k] + share * (path[k + 1] - path[k]) for share in shares]
        deepest = min(chain_clearance(nodes, radius, obstacles) for nodes in between)
        if deepest < min(*ends, 0.0) - MAX_OVERLAP * diameter:
            return True
    return False


def _perturbed(model: RodModel[Dimensions], state: RodState) -> RodState:
    """Return the state with a small smooth displacement off its plane and off its line."""
    bump = np.sin(np.linspace(0.0, np.pi, model.node_count)) ** 2
    ripple = np.sin(np.linspace(0.0, 2.0 * np.pi, model.node_count)) * bump
    offset = bump[:, None] * np.array([0.5, 0.7, -0.3]) + ripple[:, None] * np.array(
        [0.4, -0.6, 0.5]
    )
    moved = state.positions + PERTURBATION_SIZE * model.properties.length * offset
    return RodState(moved, state.orientations, state.velocities, state.angular_velocities)
