"""Alternative paths: several clear paths to one goal that pass the obstacles differently."""

from __future__ import annotations

import numpy as np

from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.problem import Problem, WholePath
from lariat.planning.refinement import is_clear, refined_path, seed_candidates
from lariat.planning.whole_path import plan

MAX_GUESSES = 8
"""Largest number of seed paths that are refined."""
MIN_DIFFERENCE = 0.05
"""Distance of the rope's middle somewhere along two paths, from each other's nearest place,
above which they are different [m]."""
MAX_DURATION_RATIO = 3.0
"""Duration, relative to the shortest one, above which a path is left out [-]."""


def alternative_paths(problem: Problem, most: int) -> list[WholePath]:
    """Return different clear paths to the goal, ranked: the most clearance first.

    Clearance beyond the wanted one does not count; of paths with the same clearance the one that
    takes less time comes first, then the one along which the grips travel less. The path that
    `lariat.planning.whole_path.plan` finds, or a better one like it, is among them; where it does
    not reach the goal it is the only one.
    """
    first = plan(problem)
    if not first.reached:
        return [first]
    optimizer = PathOptimizer(problem)
    guesses = seed_candidates(optimizer, MAX_GUESSES)
    others = [refined_path(optimizer, guess) for guess in guesses]
    paths = [first, *(path for path in others if path.reached and is_clear(path, optimizer))]
    shortest = min(path.duration for path in paths)
    ranked: list[WholePath] = []
    for path in sorted(paths, key=lambda path: _rank(path, optimizer.wanted_clearance)):
        short = path is first or path.duration <= MAX_DURATION_RATIO * shortest
        if short and all(difference(path, k) > MIN_DIFFERENCE for k in ranked):
            ranked.append(path)
    return ranked[:most]


def travel(path: WholePath) -> float:
    """Return the length of the grips' paths, on average [m]."""
    steps = np.linalg.norm(np.diff(path.positions, axis=0), axis=2)
    return float(np.mean(np.sum(steps, axis=0)))


def difference(first: WholePath, second: WholePath) -> float:
    """Return how far the rope's middle is on one path from anywhere it is on the other [m]."""
    middle = first.nodes.shape[1] // 2
    apart = np.linalg.norm(first.nodes[:, None, middle] - second.nodes[None, :, middle], axis=2)
    return float(max(np.max(np.min(apart, axis=0)), np.max(np.min(apart, axis=1))))


def _rank(path: WholePath, clearance: float) -> tuple[float, float, float]:
    """Sort key: lack of clearance in millimetres, then duration and travel."""
    lack = max(clearance - path.clearance, 0.0)
    return round(1e3 * lack), path.duration, travel(path)
