"""What a horizon must keep, whatever it costs: the rope is never pulled straight.

Linear bounds on the change of the variables, solved together with the objective by an active set
on their multipliers: few bounds are active, mostly none.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from services.controller.mpc.objective import Surroundings

CHANGES = 30
"""Of the active set, at most."""
SOFTENING = 1e-10
"""Of the multipliers' own equations, relative."""
SETTLED = 1e-7
"""Violation that does not count any more [m]."""


def overstretch(
    nodes: Float64[np.ndarray, "h n 3"],
    slopes: Float64[np.ndarray, "h n 3 v"],
    surroundings: Surroundings,
) -> tuple[Float64[np.ndarray, "c"], Float64[np.ndarray, "c v"]]:
    """Excess of the grips' distance and of the rope's length over what is allowed [m], and slopes.

    The length tells where the rope is taut round something that it leans on.

    Args:
        nodes: Of the model [m].
        slopes: Of the nodes in the variables.
    """
    chord = nodes[:, -1] - nodes[:, 0]
    apart = np.linalg.norm(chord, axis=1)
    pull = chord / np.maximum(apart, 1e-9)[:, None]
    edges = np.diff(nodes, axis=1)
    lengths = np.linalg.norm(edges, axis=2)
    along = edges / np.maximum(lengths, 1e-9)[..., None]
    values = [apart - surroundings.most_apart, lengths.sum(axis=1) - surroundings.longest]
    rows = [
        np.einsum("hc,hcv->hv", pull, slopes[:, -1] - slopes[:, 0]),
        np.einsum("hnc,hncv->hv", along, np.diff(slopes, axis=1)),
    ]
    return np.concatenate(values), np.concatenate(rows)


def within_reach(
    velocities: Float64[np.ndarray, "h 2 6"],
    moves: Bool[np.ndarray, "2 6"],
    ends: Float64[np.ndarray, "2 3"],
    dt: float,
    most_apart: float,
) -> Float64[np.ndarray, "h 2 6"]:
    """The velocities, less what would bring the ends further apart than is allowed.

    Step by step: what is too much goes along the line between the ends, half from each end that
    moves. Ends that are too far apart already come together.

    Args:
        velocities: Of the grips in each step [m/s, rad/s].
        moves: Which components are free.
        ends: Where both ends are before the first step [m].
        dt: Duration of a step [s].
        most_apart: [m]
    """
    free = moves[:, :3].all(axis=1)
    if not free.any():
        return velocities
    shares = np.array([[1.0], [-1.0]]) * free[:, None] / free.sum()
    kept = velocities.copy()
    for velocity in kept:
        after = ends + dt * velocity[:, :3]
        chord = after[1] - after[0]
        apart = np.linalg.norm(chord)
        if apart > most_apart:
            after = after + shares * (1.0 - most_apart / apart) * chord
            velocity[:, :3] = (after - ends) / dt
        ends = after
    return kept


def solved(
    hessian: Float64[np.ndarray, "v v"],
    slope: Float64[np.ndarray, "v"],
    values: Float64[np.ndarray, "c"],
    rows: Float64[np.ndarray, "c v"],
) -> Float64[np.ndarray, "v"]:
    """The step that minimises the quadratic and keeps values + rows @ step <= 0."""
    step = -np.linalg.solve(hessian, slope)
    broken = values + rows @ step
    (near,) = np.nonzero(np.linalg.norm(rows, axis=1) > 1e-12)
    if not len(near) or np.max(broken[near]) <= SETTLED:
        return step
    answers = np.linalg.solve(hessian, rows[near].T)
    coupling, wanted = rows[near] @ answers, broken[near]
    # Bounds of neighbouring steps are nearly parallel.
    coupling = coupling + SOFTENING * np.max(np.diag(coupling)) * np.eye(len(near))
    multipliers = np.zeros(len(near))
    active: list[int] = []
    for _ in range(CHANGES):
        left = wanted - coupling @ multipliers
        worst = int(np.argmax(left))
        if left[worst] <= SETTLED or worst in active:
            break
        active.append(worst)
        while True:
            found = np.linalg.solve(coupling[np.ix_(active, active)], wanted[active])
            if np.all(found > 0.0):
                break
            active.pop(int(np.argmin(found)))
        multipliers = np.zeros(len(near))
        multipliers[active] = found
    return step - answers @ multipliers
