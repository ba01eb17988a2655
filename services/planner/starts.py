"""First guesses of a way, found from the scene: straight, over things, around them, by chance.

A guess lifts the grips off in one direction, carries them along while they stay off, and sets them
down. Which directions and how far is read from the obstacles themselves.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from services.planner.problem import Problem
from shared.geometry import poses
from shared.geometry.obstacles import Obstacle, signed_distance

Displacements = Float64[np.ndarray, "k 2 3"]

RANDOM_COUNT = 10
SPREAD = 0.25
"""Standard deviation of a random detour [m]."""


def starts(problem: Problem, blocks: int) -> list[Displacements]:
    """Displacements of both grips in each block [m], the most direct way first."""
    found = [np.zeros(3)]
    found += over(problem)
    found += around(problem)
    random = np.random.default_rng(problem.seed)
    found += list(random.normal(scale=SPREAD, size=(RANDOM_COUNT, 3)))
    ways = [_carried(problem, offset, blocks, 0.0) for offset in found]
    # Held taut while it is carried, the rope sags less.
    ways += [_carried(problem, offset, blocks, 0.93) for offset in found[: 1 + len(over(problem))]]
    return ways


def over(problem: Problem) -> list[Float64[np.ndarray, "3"]]:
    """Lifts that bring the lowest point of the rope above things in the way."""
    lowest = min(problem.state.positions[:, 2].min(), problem.goal[:, 2].min())
    need = problem.clearance + problem.radius + 0.01
    tops = sorted({round(_extent(o, 2)[1], 3) for o in _in_the_way(problem)})
    lifts = [top + need - lowest for top in tops]
    # Several low things need one lift only; keep the highest and two below it.
    return [np.array([0.0, 0.0, lift]) for lift in lifts[-3:] if lift > 0.0]


def around(problem: Problem) -> list[Float64[np.ndarray, "3"]]:
    """Sidesteps to both sides of everything in the way, low and across."""
    nodes = np.concatenate([problem.state.positions, problem.goal])
    need = problem.clearance + problem.radius + 0.02
    blocking = _in_the_way(problem)
    detours = []
    for axis in (0, 1):
        if not blocking:
            break
        low = min(_extent(o, axis)[0] for o in blocking)
        high = max(_extent(o, axis)[1] for o in blocking)
        for shift in (low - need - nodes[:, axis].max(), high + need - nodes[:, axis].min()):
            if 0.0 < abs(shift) < 0.7:
                detours.append(shift * np.eye(3)[axis])
    return detours


def _carried(
    problem: Problem, offset: Float64[np.ndarray, "3"], blocks: int, taut: float
) -> Displacements:
    begin = np.stack([g.position for g in problem.grips])
    end = np.stack([g.position for g in problem.goal_grips])
    s = np.linspace(0.0, 1.0, blocks + 1)[:, None, None]
    if not offset.any() and not taut:
        ways = begin + s * (end - begin)
    else:
        along = np.clip(2.0 * s - 0.5, 0.0, 1.0)
        off = np.clip(np.minimum(s, 1.0 - s) * 4.0, 0.0, 1.0)
        middle = begin + along * (end - begin)
        if taut:
            middle = middle + off * _apart(problem, middle, taut)
        ways = middle + off * offset
    moves = problem.moves[:, :3]
    return np.diff(np.where(moves, ways, begin), axis=0)


def _apart(
    problem: Problem, ways: Float64[np.ndarray, "w 2 3"], taut: float
) -> Float64[np.ndarray, "w 2 3"]:
    """What brings the grips to a fraction of the rope's length from each other."""
    chord = ways[:, 1] - ways[:, 0]
    distance = np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-9)
    more = 0.5 * np.maximum(taut * problem.rod.properties.length - distance, 0.0)
    return np.stack([-more * chord / distance, more * chord / distance], axis=1)


def _in_the_way(problem: Problem) -> list[Obstacle]:
    """Obstacles near any of the straight ways of the nodes."""
    s = np.linspace(0.0, 1.0, 9)[:, None, None]
    swept = problem.state.positions + s * (problem.goal - problem.state.positions)
    reach = 0.12 + problem.clearance
    return [
        o
        for o in problem.solid
        if o.shape != "half_space" and np.min(signed_distance(swept.reshape(-1, 3), o)) < reach
    ]


def _extent(obstacle: Obstacle, axis: int) -> tuple[float, float]:
    """Lowest and highest coordinate of an obstacle along a world axis, at most [m]."""
    local = np.abs(poses.rotate(poses.conjugate(np.array(obstacle.orientation)), np.eye(3)[axis]))
    match obstacle.shape:
        case "box":
            half = float(local @ np.array(obstacle.size)) / 2.0
        case "sphere":
            half = obstacle.radius
        case "capsule":
            half = obstacle.radius + local[2] * obstacle.height / 2.0
        case _:
            across = float(np.hypot(local[0], local[1]))
            half = obstacle.radius * across + local[2] * obstacle.height / 2.0
    centre = obstacle.position[axis]
    return centre - half, centre + half
