"""First guesses of a way, found from the scene: straight, over things, around them, by chance.

A guess lifts the grips off in one direction, carries them along while they stay off, and sets them
down. Which directions and how far is read from the obstacles themselves.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle, signed_distance
from services.planner.problem import Problem

Displacements = Float64[np.ndarray, "k 2 3"]

RANDOM_COUNT = 10
SPREAD = 0.25
"""Standard deviation of a random detour [m]."""
OTHER_COUNT = 24
LEAST_TAUT, MOST_TAUT = 0.3, 0.95
"""Distances of the grips on the ways of `others`, as shares of the rope's length."""


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


def others(problem: Problem, blocks: int) -> list[Displacements]:
    """More ways, by chance, for a goal that the usual ones do not lead to.

    Between the same grips a rope may rest in several shapes; in which it ends depends on where each
    end comes from. So both ends make detours of their own here, at any distance from each other.
    """
    random = np.random.default_rng([problem.seed, 1])
    begin = np.stack([g.position for g in problem.grips])
    end = np.stack([g.position for g in problem.goal_grips])
    moves = problem.moves[:, :3]
    low, high = np.array(problem.limits.workspace)
    found = []
    for _ in range(OTHER_COUNT):
        share = random.uniform(0.4, 0.8)
        middle = begin.mean(axis=0) + random.uniform(0.3, 1.0) * (end - begin).mean(axis=0)
        middle = middle + random.normal(scale=SPREAD / 2.0, size=3)
        heading = random.normal(size=3) + (end[1] - end[0]) / problem.rod.properties.length
        half = 0.5 * random.uniform(LEAST_TAUT, MOST_TAUT) * problem.rod.properties.length
        chord = half * poses.normalized(heading)
        via = np.clip(np.stack([middle - chord, middle + chord]), low, high)
        s = np.linspace(0.0, 1.0, blocks + 1)[:, None, None]
        there, back = np.minimum(s / share, 1.0), np.maximum((s - share) / (1.0 - share), 0.0)
        ways = begin + there * (via - begin) + back * (end - via)
        found.append(np.diff(np.where(moves, ways, begin), axis=0))
    return found


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
