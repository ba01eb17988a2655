"""Plan of a whole path: seeds, tree searches, and the order in which they are tried."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines
from lariat.planning.arms.arm_check import goal_fault
from lariat.planning.landing import plan_landing
from lariat.planning.laying import plan_laying
from lariat.planning.no_path_proof import proof_of_no_path
from lariat.planning.path_optimization.optimizer import PathCandidate, PathOptimizer
from lariat.planning.problem import Problem, WholePath, grip_distance
from lariat.planning.refinement import followed, is_clear, rank, refined_path, seed_candidates
from lariat.planning.retiming import SUFFICIENT_CLEARANCE
from lariat.planning.shorter_path import nearest_path, stay
from lariat.planning.tree_search.search import TreePath, TreeSearch

MAX_REFINED = 3
"""Largest number of seeds that are refined."""
MAX_SEED_SHORTFALL = 0.01
"""Shortfall of the best seed above which the trees are tried before a seed is refined [m]."""
TREE_CLEARANCES = (0.8, 0.5, 0.65)
"""Clearances of the tree searches in the order of trial: the first one relative to the wanted
clearance, the others to the necessary one."""
TREE_ITERATIONS = 3
"""Largest number of Gauss-Newton iterations of a path that the trees found."""
TREE_GROWTH = (10, 150)
"""Numbers of iterations after which the searches take turns: after few, they have tried to lead the
rope lengthwise through each narrow passage."""
MAX_REST_ERROR = 0.02
"""Mean node distance of the goal from a rest shape between its grips above which the trees are not
tried, because the goal is not a shape that the rope takes [m]."""


class PlanningTime:
    """Processor time since the beginning of a plan; when it is over, no further search is begun."""

    def __init__(self, limit: float, clock: Callable[[], float] = time.process_time) -> None:
        """Begin to count; a plan may take the limit [s]."""
        self._limit, self._clock = limit, clock
        self._began = clock()
        self.cut = False
        """Whether a search was left out because the time was over."""

    def is_over(self) -> bool:
        """Return whether the time is over; asked before every search that is left out then."""
        over = self._clock() - self._began > self._limit
        self.cut = self.cut or over
        return over


def plan(problem: Problem) -> WholePath:
    """Return the best path found; its `reason` is empty when it reaches the goal."""
    if problem.goal.route:
        return plan_laying(problem, plan)
    clock = PlanningTime(problem.planning_time)
    path = plan_landing(problem, lambda approach: _plan(approach, clock))
    if path is not None and path.reached:
        return path
    path = _plan(problem, clock)
    if path.reached or not clock.cut:
        return path
    limit = f"no path was found within {problem.planning_time:g} s (control.planning_time)"
    return replace(path, reason=f"{path.reason}; {limit}")


def _plan(problem: Problem, clock: PlanningTime) -> WholePath:
    """Best path found straight to the goal."""
    optimizer = PathOptimizer(problem)
    if optimizer.goal_clearance < 0.0:
        return stay(problem, f"blocked: the goal itself {_conflict_at_goal(problem)}")
    if at_goal := goal_fault(problem):
        return stay(problem, f"unreachable: at the goal itself, {at_goal}")
    candidates = seed_candidates(optimizer, MAX_REFINED)
    searched = None
    if candidates[0].shortfall > MAX_SEED_SHORTFALL:
        # No seed leads through: the trees are tried before one is refined in vain.
        searched = _search_trees(optimizer, clock)
        if searched.path is not None and searched.path.reached:
            return searched.path
        if searched.proof:
            return nearest_path(problem, searched.tree_path, candidates, searched.proof)
    best = _best_path(optimizer, candidates[:1] if searched else candidates, clock)
    if best.reached:
        return best
    searched = searched or _search_trees(optimizer, clock)
    best = max([best, searched.path or best], key=lambda path: rank(path, optimizer))
    if is_clear(best, optimizer):
        return best
    reason = searched.proof or best.reason
    return nearest_path(problem, searched.tree_path, candidates, reason)


def _best_path(
    optimizer: PathOptimizer, candidates: Sequence[PathCandidate], clock: PlanningTime
) -> WholePath:
    """Path of the first candidate with sufficient clearance, or the best of all."""
    sufficient = SUFFICIENT_CLEARANCE * optimizer.wanted_clearance
    paths: list[WholePath] = []
    for candidate in candidates:
        paths.append(refined_path(optimizer, candidate))
        if paths[-1].reached and paths[-1].clearance > sufficient:
            return paths[-1]
        if candidate is not candidates[-1] and clock.is_over():
            break
    return max(paths, key=lambda path: rank(path, optimizer))


@dataclass(frozen=True)
class Searched:
    """Result of the tree searches."""

    path: WholePath | None = None
    """Best path that leads to the goal; None where there is none."""
    tree_path: TreePath | None = None
    """Path of the last search."""
    proof: str = ""
    """Reason why there is no path; empty where there may be one."""


def _search_trees(optimizer: PathOptimizer, clock: PlanningTime) -> Searched:
    """Path along which the grips turn, by tree searches for less and less clearance."""
    problem = optimizer.problem
    if not _is_rest_shape(problem):
        return Searched(proof=proof_of_no_path(problem))
    low, high = np.array(problem.limits.workspace)
    ends = np.stack([grip.position for grip in problem.feasible_goal_grips])
    apart = grip_distance(problem.feasible_goal_grips)
    if np.any(ends < low) or np.any(ends > high) or apart > problem.longest_grip_distance:
        return Searched()
    searches: list[TreeSearch] = []
    paths: list[WholePath] = []
    tree_path, proof = None, ""
    for until, (seed, share) in product(TREE_GROWTH, enumerate(TREE_CLEARANCES)):
        if seed == len(searches):
            least = optimizer.necessary_clearance if seed else optimizer.wanted_clearance
            searches.append(TreeSearch(problem, share * least, seed))
        elif seed == 0:
            # Before a thorough search: an opening is passed at once, or takes long.
            proof = proof_of_no_path(problem)
        if proof or clock.is_over():
            break
        tree_path = searches[seed].run(until)
        if tree_path.reaches_goal:
            follower, start = followed(problem, tree_path)
            follower.led_arms = optimizer.led_arms
            paths.append(refined_path(follower, start, TREE_ITERATIONS))
            if paths[-1].reached and is_clear(paths[-1], optimizer):
                break
    best = max(paths, key=lambda path: rank(path, optimizer), default=None)
    return Searched(best, tree_path, proof)


def _is_rest_shape(problem: Problem) -> bool:
    """Whether the goal is near a shape that the rope takes between its grips."""
    nodes = problem.goal.nodes
    try:
        rest = problem.rest(problem.feasible_goal_grips, nodes)
    except ValueError:
        return False
    apart = polylines.mean_node_distance(rest.positions, nodes)
    return apart < MAX_REST_ERROR


def _conflict_at_goal(problem: Problem) -> str:
    """Words on the obstacle with which the goal overlaps most, or the region that it leaves."""
    worst = min(
        problem.obstacles,
        key=lambda o: geometry.chain_clearance(problem.goal.nodes, problem.radius, [o]),
    )
    return f"leaves region {worst.name!r}" if worst.keep_in else f"lies in obstacle {worst.name!r}"
