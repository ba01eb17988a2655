"""Plan of a whole path: seeds, tree searches, and the order in which they are tried."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines
from lariat.planning.arms.arm_check import goal_fault
from lariat.planning.landing import landed, landing
from lariat.planning.laying import plan_laying
from lariat.planning.no_path_proof import proof_of_no_path
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.planning_time import PlanningTime
from lariat.planning.problem import Problem, WholePath, grip_distance
from lariat.planning.refinement import (
    best_path,
    distinct,
    followed,
    is_clear,
    rank,
    refined_path,
)
from lariat.planning.seeds import seed_paths
from lariat.planning.settings import PLANNER_SETTINGS, PlannerSettings
from lariat.planning.shorter_path import nearest_path, stay
from lariat.planning.tree_search.search import TreePath, TreeSearch
from lariat.rod import state_along


def plan(problem: Problem, settings: PlannerSettings = PLANNER_SETTINGS) -> WholePath:
    """Return the best path found; its `reason` is empty when it reaches the goal.

    Args:
        problem: Planning problem.
        settings: Effort.
    """
    if problem.goal.route:
        return plan_laying(problem, lambda approach: plan(approach, settings))
    time = PlanningTime(problem.planning_time)
    last_part = landing(problem)
    if last_part is not None:
        approach = _plan(last_part.approach, settings, time)
        path = landed(problem, last_part, approach) if approach.reached else approach
        if path.reached:
            return path
    path = _plan(problem, settings, time)
    if path.reached or not time.cut:
        return path
    limit = f"no path was found within {problem.planning_time:g} s (control.planning_time)"
    return replace(path, reason=f"{path.reason}; {limit}")


def _plan(problem: Problem, settings: PlannerSettings, time: PlanningTime) -> WholePath:
    """Best path found straight to the goal."""
    optimizer = PathOptimizer(problem)
    if optimizer.goal_clearance < 0.0:
        return stay(problem, f"blocked: the goal itself {_conflict_at_goal(problem)}")
    if at_goal := goal_fault(problem):
        return stay(problem, f"unreachable: at the goal itself, {at_goal}")
    seeds = optimizer.evaluate(seed_paths(problem, optimizer.settings.blocks))
    candidates = distinct(sorted(seeds, key=lambda c: c.cost), settings)[: settings.max_refined]
    searched = None
    if candidates[0].shortfall > settings.max_seed_shortfall:
        # No seed leads through: the trees are tried before one is refined in vain.
        searched = _search_trees(problem, optimizer, settings, time)
        if searched.path is not None and searched.path.reached:
            return searched.path
        if searched.proof:
            return nearest_path(problem, searched.tree_path, candidates, searched.proof, settings)
    likely = candidates[:1] if searched else candidates
    best = best_path(problem, optimizer, likely, settings, time)
    if best.reached:
        return best
    searched = searched or _search_trees(problem, optimizer, settings, time)
    best = max([best, searched.path or best], key=lambda path: rank(path, optimizer))
    if is_clear(best, optimizer):
        return best
    reason = searched.proof or best.reason
    return nearest_path(problem, searched.tree_path, candidates, reason, settings)


@dataclass(frozen=True)
class Searched:
    """Result of the tree searches."""

    path: WholePath | None = None
    """Best path that leads to the goal; None where there is none."""
    tree_path: TreePath | None = None
    """Path of the last search."""
    proof: str = ""
    """Reason why there is no path; empty where there may be one."""


def _search_trees(
    problem: Problem, optimizer: PathOptimizer, settings: PlannerSettings, time: PlanningTime
) -> Searched:
    """Path along which the grips turn, by tree searches for less and less clearance."""
    if not _is_rest_shape(problem, settings):
        return Searched(proof=proof_of_no_path(problem))
    low, high = np.array(problem.limits.workspace)
    ends = np.stack([grip.position for grip in problem.feasible_goal_grips])
    apart = grip_distance(problem.feasible_goal_grips)
    if np.any(ends < low) or np.any(ends > high) or apart > problem.longest_grip_distance:
        return Searched()
    refinement = replace(settings, iterations=settings.tree_iterations)
    searches: list[TreeSearch] = []
    paths: list[WholePath] = []
    tree_path, proof = None, ""
    for until, (seed, share) in product(settings.tree_growth, enumerate(settings.tree_clearances)):
        if seed == len(searches):
            least = optimizer.necessary_clearance if seed else optimizer.wanted_clearance
            searches.append(TreeSearch(problem, share * least, seed))
        elif seed == 0:
            # Before a thorough search: an opening is passed at once, or takes long.
            proof = proof_of_no_path(problem)
        if proof or time.is_over():
            break
        tree_path = searches[seed].run(until)
        if tree_path.reaches_goal:
            follower, start = followed(problem, tree_path)
            paths.append(refined_path(problem, follower, start, refinement))
            if paths[-1].reached and is_clear(paths[-1], optimizer):
                break
    best = max(paths, key=lambda path: rank(path, optimizer), default=None)
    return Searched(best, tree_path, proof)


def _is_rest_shape(problem: Problem, settings: PlannerSettings) -> bool:
    """Whether the goal is near a shape that the rope takes between its grips."""
    left, right = problem.feasible_goal_grips
    guess = state_along(problem.goal.nodes, left.orientation, right.orientation)
    try:
        rest = problem.rod.rest(left, right, guess=guess, obstacles=problem.packed_supports)
    except ValueError:
        return False
    apart = polylines.mean_node_distance(rest.state.positions, problem.goal.nodes)
    return apart < settings.max_rest_error


def _conflict_at_goal(problem: Problem) -> str:
    """Words on the obstacle with which the goal overlaps most, or the region that it leaves."""
    worst = min(
        problem.obstacles,
        key=lambda o: geometry.chain_clearance(problem.goal.nodes, problem.radius, [o]),
    )
    return f"leaves region {worst.name!r}" if worst.keep_in else f"lies in obstacle {worst.name!r}"
