"""Seed paths: initial guesses for the optimisation, derived from the scene or at random.

A seed moves both grips to an offset, carries them at that offset to the goal, and removes it there.
The offsets lead over or around the obstacles in between.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.planning.path_optimization.block_path import BLOCKS
from lariat.planning.problem import Problem

Displacements = Float64[np.ndarray, "k 2 3"]
"""Displacement of both grips in each block [m]."""


RANDOM_OFFSET_COUNT = 10
"""Number of seeds with a random offset."""
RANDOM_OFFSET_SIGMA = 0.25
"""Standard deviation of a random offset [m]."""
CARRIED_STRETCH = 0.93
"""Grip distance of a taut seed while it is carried, relative to the rope's length."""
LIFT_MARGIN = 0.01
"""Margin of a lift over obstacles, in addition to the clearance [m]."""
SIDESTEP_MARGIN = 0.02
"""Margin of a sidestep around obstacles, in addition to the clearance [m]."""
MAX_SIDESTEP = 0.7
"""Longest sidestep [m]."""
MAX_LIFTS = 3
"""Largest number of lifts; those over the highest obstacles are kept."""
RELEVANT_DISTANCE = 0.12
"""Distance from the straight paths of the nodes, in addition to the clearance, within which an
obstacle is relevant [m]."""


def seed_paths(problem: Problem) -> list[Displacements]:
    """Return seed paths as displacements in blocks, the most direct one first."""
    offsets = [np.zeros(3)]
    lifts = lift_offsets(problem)
    offsets += lifts
    offsets += sidestep_offsets(problem)
    random = np.random.default_rng(problem.seed)
    offsets += list(random.normal(scale=RANDOM_OFFSET_SIGMA, size=(RANDOM_OFFSET_COUNT, 3)))
    paths = [_carried_path(problem, offset, 0.0) for offset in offsets]
    # The rope sags less while it is carried taut.
    paths += [_carried_path(problem, o, CARRIED_STRETCH) for o in offsets[: 1 + len(lifts)]]
    return paths + _swung_paths(problem)


def lift_offsets(problem: Problem) -> list[Float64[np.ndarray, "3"]]:
    """Return lifts that bring the lowest point of the rope over relevant obstacles [m]."""
    lowest = min(problem.state.positions[:, 2].min(), problem.goal.nodes[:, 2].min())
    need = problem.clearance + problem.radius + LIFT_MARGIN
    tops = sorted({round(_extent(o, 2)[1], 3) for o in _relevant_obstacles(problem)})
    lifts = [top + need - lowest for top in tops]
    # Several low obstacles need one lift only.
    return [np.array([0.0, 0.0, lift]) for lift in lifts[-MAX_LIFTS:] if lift > 0.0]


def sidestep_offsets(problem: Problem) -> list[Float64[np.ndarray, "3"]]:
    """Return horizontal sidesteps to both sides of all relevant obstacles [m]."""
    nodes = np.concatenate([problem.state.positions, problem.goal.nodes])
    need = problem.clearance + problem.radius + SIDESTEP_MARGIN
    relevant = _relevant_obstacles(problem)
    offsets = []
    for axis in (0, 1):
        if not relevant:
            break
        low = min(_extent(o, axis)[0] for o in relevant)
        high = max(_extent(o, axis)[1] for o in relevant)
        for shift in (low - need - nodes[:, axis].max(), high + need - nodes[:, axis].min()):
            if 0.0 < abs(shift) < MAX_SIDESTEP:
                offsets.append(shift * np.eye(3)[axis])
    return offsets


def _carried_path(
    problem: Problem, offset: Float64[np.ndarray, "3"], stretch: float
) -> Displacements:
    """Path at an offset, with the grips at least `stretch` rope lengths apart in between."""
    begin = np.stack([g.position for g in problem.grips])
    end = np.stack([g.position for g in problem.goal.grips])
    s = np.linspace(0.0, 1.0, BLOCKS + 1)[:, None, None]
    if not offset.any() and not stretch:
        path = begin + s * (end - begin)
    else:
        along = np.clip(2.0 * s - 0.5, 0.0, 1.0)
        off = np.clip(np.minimum(s, 1.0 - s) * 4.0, 0.0, 1.0)
        middle = begin + along * (end - begin)
        if stretch:
            middle = middle + off * _stretching(problem, middle, stretch)
        path = middle + off * offset
    moves = problem.moves[:, :3]
    return np.diff(np.where(moves, path, begin), axis=0)


def _swung_paths(problem: Problem) -> list[Displacements]:
    """Paths on which ends that change sides pass each other on the right or on the left.

    In between, a rope that stays in one plane may throw its loop to either side.
    """
    begin, end = (
        np.stack([g.position for g in ends]) for ends in (problem.grips, problem.goal.grips)
    )
    first, last = begin[1] - begin[0], end[1] - end[0]
    if first @ last >= 0.0:
        return []
    aside = 0.5 * np.cross([0.0, 0.0, 1.0], first - last)
    s = np.linspace(0.0, 1.0, BLOCKS + 1)[:, None, None]
    swings = 0.5 * np.sin(np.pi * s) * np.stack([-aside, aside])
    moves = problem.moves[:, :3]
    return [
        np.diff(np.where(moves, begin + s * (end - begin) + side * swings, begin), axis=0)
        for side in (1.0, -1.0)
    ]


def _stretching(
    problem: Problem, path: Float64[np.ndarray, "w 2 3"], stretch: float
) -> Float64[np.ndarray, "w 2 3"]:
    """Displacements that bring the grips `stretch` rope lengths apart where they are closer [m]."""
    chord = path[:, 1] - path[:, 0]
    distance = np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-9)
    more = 0.5 * np.maximum(stretch * problem.rod.properties.length - distance, 0.0)
    return np.stack([-more * chord / distance, more * chord / distance], axis=1)


def _relevant_obstacles(problem: Problem) -> list[Obstacle]:
    """Obstacles near any of the straight paths of the nodes."""
    s = np.linspace(0.0, 1.0, 9)[:, None, None]
    swept = problem.state.positions + s * (problem.goal.nodes - problem.state.positions)
    reach = RELEVANT_DISTANCE + problem.clearance
    lowest = float(swept[..., 2].min()) - problem.radius
    return [
        o
        for o in problem.solid
        # The rope passes above a floor, which needs neither a lift nor a sidestep.
        if o.shape != "half_space"
        and not (_extent(o, 2)[1] <= lowest and _is_wide(o, swept.reshape(-1, 3)))
        and np.min(signed_distance(swept.reshape(-1, 3), o)) < reach
    ]


def _is_wide(obstacle: Obstacle, points: Float64[np.ndarray, "p 3"]) -> bool:
    """Whether an obstacle extends below all points."""
    extents = np.array([_extent(obstacle, axis) for axis in (0, 1)])
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    return bool(np.all(extents[:, 0] <= low) and np.all(extents[:, 1] >= high))


def _extent(obstacle: Obstacle, axis: int) -> tuple[float, float]:
    """Lowest and highest coordinate of an obstacle along a world axis [m]."""
    centre, half = obstacle.position[axis], obstacle.extents[axis]
    return centre - half, centre + half
