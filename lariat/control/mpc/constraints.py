"""Constraints of the horizon: bounds on grip distance and rope length.

They are linear bounds on the change of the variables, solved together with the objective by an
active-set method on their multipliers: few bounds are active, mostly none.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.mpc.collision_avoidance import AvoidanceSpecification

MAX_ACTIVE_SET_CHANGES = 30
"""Maximum number of changes of the active set."""
MULTIPLIER_REGULARIZATION = 1e-10
"""Regularization of the multipliers' equations, relative to their largest diagonal entry [-]."""
CONSTRAINT_TOLERANCE = 1e-7
"""Violation below which a constraint counts as satisfied [m]."""


def overstretch(
    nodes: Float64[np.ndarray, "h n 3"],
    jacobian: Float64[np.ndarray, "h n 3 v"],
    avoidance: AvoidanceSpecification,
    rest_length: float,
) -> tuple[Float64[np.ndarray, "c"], Float64[np.ndarray, "c v"]]:
    """Excess of grip distance and rope length over what is allowed [m], and its Jacobian.

    The length matters where the rope is taut around something that it leans on.

    Args:
        nodes: Nodes of the model [m].
        jacobian: Derivative of the nodes with respect to the variables.
        avoidance: Limits of grip distance and stretch.
        rest_length: Length of the model at rest [m], which may be learnt.
    """
    count, size = len(nodes), jacobian.shape[-1]
    chord, edges = nodes[:, -1] - nodes[:, 0], nodes[:, 1:] - nodes[:, :-1]
    distance = np.sqrt(np.einsum("hc,hc->h", chord, chord))
    lengths = np.sqrt(np.einsum("hnc,hnc->hn", edges, edges))
    along = edges / np.maximum(lengths, 1e-9)[..., None]
    # Derivatives of distance and length in the nodes.
    pulls = np.zeros((count, 2, *nodes.shape[1:]))
    pulls[:, 0, -1] = chord / np.maximum(distance, 1e-9)[:, None]
    pulls[:, 0, 0] = -pulls[:, 0, -1]
    pulls[:, 1, 1:] = along
    pulls[:, 1, :-1] -= along
    values = np.empty((count, 2))
    values[:, 0] = distance - avoidance.max_grip_distance
    values[:, 1] = lengths.sum(axis=1) - (1.0 + avoidance.max_stretch) * rest_length
    rows = pulls.reshape(count, 2, -1) @ jacobian.reshape(count, -1, size)
    return values.ravel(), rows.reshape(-1, size)


def limit_grip_distance(
    velocities: Float64[np.ndarray, "h 2 6"],
    moves: Bool[np.ndarray, "2 6"],
    ends: Float64[np.ndarray, "2 3"],
    dt: float,
    max_grip_distance: float,
) -> Float64[np.ndarray, "h 2 6"]:
    """Velocities without the part that would move the ends too far apart.

    Step by step, the excess distance is removed along the line between the ends, half at each end
    if both move. Ends that are too far apart already are brought together.

    Args:
        velocities: Velocities of the grips in each step [m/s, rad/s].
        moves: Free components of each grip's velocity.
        ends: Positions of both ends before the first step [m].
        dt: Duration of a step [s].
        max_grip_distance: Maximum distance between the ends [m].
    """
    free = moves[:, :3].all(axis=1)
    if not free.any():
        return velocities
    shares = np.array([[1.0], [-1.0]]) * free[:, None] / free.sum()
    limited = velocities.copy()
    for velocity in limited:
        after = ends + dt * velocity[:, :3]
        chord = after[1] - after[0]
        distance = np.linalg.norm(chord)
        if distance > max_grip_distance:
            after = after + shares * (1.0 - max_grip_distance / distance) * chord
            velocity[:, :3] = (after - ends) / dt
        ends = after
    return limited


def constrained_step(
    hessian: Float64[np.ndarray, "v v"],
    gradient: Float64[np.ndarray, "v"],
    values: Float64[np.ndarray, "c"],
    rows: Float64[np.ndarray, "c v"],
) -> Float64[np.ndarray, "v"]:
    """Step that minimizes the quadratic model subject to values + rows @ step <= 0.

    Args:
        hessian: Hessian of the objective.
        gradient: Gradient of the objective.
        values: Constraint values at the present point [m].
        rows: Jacobian of the constraints.
    """
    step = -np.linalg.solve(hessian, gradient)
    violation = values + rows @ step
    if np.max(violation) <= CONSTRAINT_TOLERANCE:
        return step
    (movable,) = np.nonzero(np.linalg.norm(rows, axis=1) > 1e-12)
    if not len(movable):
        return step
    responses = np.linalg.solve(hessian, rows[movable].T)
    coupling, excess = rows[movable] @ responses, violation[movable]
    # Bounds of neighbouring steps are nearly parallel.
    coupling = coupling + MULTIPLIER_REGULARIZATION * np.max(np.diag(coupling)) * np.eye(
        len(movable)
    )
    multipliers = np.zeros(len(movable))
    active: list[int] = []
    for _ in range(MAX_ACTIVE_SET_CHANGES):
        remaining = excess - coupling @ multipliers
        worst = int(np.argmax(remaining))
        if remaining[worst] <= CONSTRAINT_TOLERANCE or worst in active:
            break
        active.append(worst)
        while True:
            duals = np.linalg.solve(coupling[np.ix_(active, active)], excess[active])
            if np.all(duals > 0.0):
                break
            active.pop(int(np.argmin(duals)))
        multipliers = np.zeros(len(movable))
        multipliers[active] = duals
    return step - responses @ multipliers
