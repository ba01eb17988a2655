"""Refinement of candidates to timed paths, and the choice of the best of them."""

from __future__ import annotations

import numpy as np

from lariat.planning.arms.arm_check import LEAST_LINK_MARGIN
from lariat.planning.path_check import CLEARANCE_TOLERANCE
from lariat.planning.path_optimization.block_path import blocks_of
from lariat.planning.path_optimization.optimizer import PathCandidate, PathOptimizer
from lariat.planning.problem import Problem, WholePath
from lariat.planning.retiming import CLOSE_PACES, PACES, retime
from lariat.planning.seeds import seed_paths
from lariat.planning.tree_search.search import TreePath

ITERATIONS = 12
"""Largest number of Gauss-Newton iterations of a candidate."""
WIDER_ITERATIONS = 5
"""Largest number of further iterations with a larger reserve."""
MAX_LED_ARMS = 5
"""Largest number of candidates that are refined for the arms, too."""
RESERVE_PER_SHORTFALL = 1.3
"""Reserve that is added per clearance lost in motion [-]."""
MIN_DIFFERENCE = 0.04
"""Motion of the grips halfway, beyond which two candidates are different paths [m] or [rad]."""


def followed(problem: Problem, tree_path: TreePath) -> tuple[PathOptimizer, PathCandidate]:
    """Return an optimiser for a path of the trees, and its candidate with the whole rod."""
    blocks = blocks_of(float(np.sum(tree_path.step_lengths)))
    optimizer = PathOptimizer(problem, blocks=blocks)
    return optimizer, optimizer.follow(tree_path.displacements(blocks))


def refined_path(
    optimizer: PathOptimizer, start: PathCandidate, iterations: int = ITERATIONS
) -> WholePath:
    """Return the timed path of a candidate after its refinement."""
    problem = optimizer.problem
    candidate = optimizer.refine(start, iterations)
    if problem.variants:
        unsure = optimizer.allow_for_uncertainty(candidate)
        candidate = optimizer.refine(unsure, WIDER_ITERATIONS)
    path = retime(optimizer, candidate)
    least = optimizer.wanted_clearance - max(candidate.shortfall, 0.0)
    if path.clearance < least - CLEARANCE_TOLERANCE:
        # Smoothing and swing reduce the clearance: refine with a larger reserve.
        lack = RESERVE_PER_SHORTFALL * (least - path.clearance)
        wider = PathOptimizer(problem, optimizer.reserve + lack, optimizer.blocks)
        again = wider.refine(wider.allow_for_uncertainty(candidate), WIDER_ITERATIONS)
        path = max(path, retime(wider, again), key=lambda p: rank(p, optimizer))
    led_arms = optimizer.led_arms
    known = any(_alike(candidate, other) for other in led_arms)
    if path.arm_fault and not known and len(led_arms) < MAX_LED_ARMS:
        # Keep the constraints of the arms, too.
        led_arms.append(candidate)
        around = PathOptimizer(problem, optimizer.reserve, optimizer.blocks, avoid_with_arms=True)
        again = around.refine(around.reevaluate(candidate), iterations)
        hopeless = around.wanted_clearance - again.shortfall < around.required_clearance
        for paces in (PACES, CLOSE_PACES[:1]):
            # Where links have no room to spare, no corner may be cut.
            if path.arm_fault and not hopeless:
                retimed = retime(around, again, LEAST_LINK_MARGIN, paces)
                path = max(path, retimed, key=lambda p: rank(p, optimizer))
    return path


def is_clear(path: WholePath, optimizer: PathOptimizer) -> bool:
    """Return whether a path is clear of obstacles, and the arms can go it."""
    least = optimizer.required_clearance - CLEARANCE_TOLERANCE
    return path.clearance >= least and not path.arm_fault


def rank(path: WholePath, optimizer: PathOptimizer) -> tuple[bool, bool, float]:
    """Return the key by which paths are sorted: reached, clear, clearance or nearness to goal."""
    clear = is_clear(path, optimizer)
    value = path.clearance if path.reached or not clear else -path.final_error
    return path.reached, clear, value


def seed_candidates(optimizer: PathOptimizer, most: int) -> list[PathCandidate]:
    """Return the cheapest candidates of the seed paths of which no two are alike halfway."""
    guesses = [optimizer.translated(seed) for seed in seed_paths(optimizer.problem)]
    kept: list[PathCandidate] = []
    for candidate in sorted(guesses, key=lambda guess: guess.cost):
        if not any(_alike(candidate, other) for other in kept):
            kept.append(candidate)
    return kept[:most]


def _alike(first: PathCandidate, second: PathCandidate) -> bool:
    """Whether the grips are at the same places halfway along two candidates."""
    halves = [c.displacements[: len(c.displacements) // 2].sum(axis=0) for c in (first, second)]
    return bool(np.max(np.abs(halves[0] - halves[1])) <= MIN_DIFFERENCE)
