"""Refinement of candidates to timed paths, and the choice of the best of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.planning.arms.arm_check import LEAST_LINK_MARGIN
from lariat.planning.path_optimization.optimizer import SETTINGS, PathCandidate, PathOptimizer
from lariat.planning.planning_time import PlanningTime
from lariat.planning.problem import Problem, WholePath
from lariat.planning.retiming import RETIMING_SETTINGS, required_clearance, retime
from lariat.planning.settings import PlannerSettings
from lariat.planning.tree_search.search import TreePath, pose_displacements


def followed(problem: Problem, tree_path: TreePath) -> tuple[PathOptimizer, PathCandidate]:
    """Return an optimiser for a path of the trees, and its candidate with the whole rod.

    Args:
        problem: Planning problem.
        tree_path: Path that the trees found.
    """
    lengths = tree_path.step_lengths
    optimizer = PathOptimizer(problem, settings=SETTINGS.for_length(float(np.sum(lengths))))
    displacements = pose_displacements(tree_path.grips, lengths, optimizer.settings.blocks)
    return optimizer, optimizer.follow(displacements)


def refined_path(
    problem: Problem, optimizer: PathOptimizer, start: PathCandidate, settings: PlannerSettings
) -> WholePath:
    """Return the timed path of a candidate after its refinement.

    Args:
        problem: Planning problem.
        optimizer: Optimiser of the problem.
        start: Candidate.
        settings: Effort.
    """
    candidate = optimizer.refine(start, settings.iterations)
    if problem.variants:
        unsure = optimizer.allow_for_uncertainty(candidate)
        candidate = optimizer.refine(unsure, settings.wider_iterations)
    path = retime(problem, optimizer, candidate)
    least = optimizer.wanted_clearance - max(candidate.shortfall, 0.0)
    if path.clearance < least - RETIMING_SETTINGS.clearance_tolerance:
        # Smoothing and swing reduce the clearance: refine with a larger reserve.
        lack = settings.reserve_per_shortfall * (least - path.clearance)
        reserve = optimizer.settings.clearance_reserve + lack
        wider = PathOptimizer(problem, reserve, optimizer.settings)
        again = wider.refine(wider.allow_for_uncertainty(candidate), settings.wider_iterations)
        retimed = retime(problem, wider, again)
        path = max(path, retimed, key=lambda p: rank(p, optimizer))
    if path.arm_fault:
        around = avoiding_with_arms(problem, optimizer)
        again = around.refine(around.reevaluate(candidate), settings.iterations)
        retimed = retime(problem, around, again, link_margin=LEAST_LINK_MARGIN)
        path = max(path, retimed, key=lambda p: rank(p, optimizer))
    return path


def is_clear(path: WholePath, optimizer: PathOptimizer) -> bool:
    """Return whether a path is clear of obstacles, and the arms can go it.

    Args:
        path: Timed path.
        optimizer: Optimiser of its problem, for the clearance below which it is blocked.
    """
    least = required_clearance(optimizer) - RETIMING_SETTINGS.clearance_tolerance
    return path.clearance >= least and not path.arm_fault


def avoiding_with_arms(problem: Problem, optimizer: PathOptimizer) -> PathOptimizer:
    """Return an optimiser that keeps the constraints of the arms, too.

    Args:
        problem: Planning problem.
        optimizer: Optimiser of the problem without them.
    """
    return PathOptimizer(problem, optimizer.reserve, optimizer.settings, avoid_with_arms=True)


def best_path(
    problem: Problem,
    optimizer: PathOptimizer,
    candidates: Sequence[PathCandidate],
    settings: PlannerSettings,
    time: PlanningTime,
) -> WholePath:
    """Return the best of the candidates' paths, or the first one with sufficient clearance.

    Args:
        problem: Planning problem.
        optimizer: Optimiser of the problem.
        candidates: Candidates in the order of trial, at least one.
        settings: Effort.
        time: Processor time of the plan.
    """
    sufficient = RETIMING_SETTINGS.sufficient_clearance * optimizer.wanted_clearance
    paths: list[WholePath] = []
    for candidate in candidates:
        paths.append(refined_path(problem, optimizer, candidate, settings))
        if paths[-1].reached and paths[-1].clearance > sufficient:
            return paths[-1]
        if candidate is not candidates[-1] and time.is_over():
            break
    return max(paths, key=lambda path: rank(path, optimizer))


def rank(path: WholePath, optimizer: PathOptimizer) -> tuple[bool, bool, float]:
    """Return the key by which paths are sorted: reached, clear, clearance or nearness to the goal.

    Args:
        path: Timed path.
        optimizer: Optimiser of its problem.
    """
    clear = is_clear(path, optimizer)
    value = path.clearance if path.reached or not clear else -path.final_error
    return path.reached, clear, value


def distinct(candidates: list[PathCandidate], settings: PlannerSettings) -> list[PathCandidate]:
    """Return the candidates whose paths differ halfway, in their order.

    Args:
        candidates: Candidates, of which the first of several alike is kept.
        settings: Distance above which two differ.
    """
    kept: list[PathCandidate] = []
    for candidate in candidates:
        here = _halfway(candidate)
        if all(np.max(np.abs(here - _halfway(k))) > settings.min_difference for k in kept):
            kept.append(candidate)
    return kept


def _halfway(candidate: PathCandidate) -> Float64[np.ndarray, "2 3"]:
    """Displacement of both grips halfway [m]."""
    half = len(candidate.displacements) // 2
    return np.sum(candidate.displacements[:half, :, :3], axis=0)
