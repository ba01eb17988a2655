"""Plan of a whole path: seeds, grid and tree searches, and the order in which they are tried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines
from lariat.planning.arms.arm_check import goal_fault
from lariat.planning.grid_search.relaxation import proof_of_no_path
from lariat.planning.grid_search.search import GridPath, block_displacements, search_grid
from lariat.planning.landing import landed, landing
from lariat.planning.laying import plan_laying
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.planning_time import PlanningTime
from lariat.planning.problem import Problem, WholePath, grip_distance
from lariat.planning.refinement import (
    avoiding_with_arms,
    best_path,
    distinct,
    is_clear,
    rank,
    refined_path,
)
from lariat.planning.seeds import random_via_paths, seed_paths
from lariat.planning.settings import PLANNER_SETTINGS, PlannerSettings
from lariat.planning.shorter_path import nearest_path, stay
from lariat.planning.tree_search.search import TreeSearch, pose_displacements
from lariat.planning.tree_search.settings import TREE_SEARCH_SETTINGS
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
    blocks = optimizer.settings.blocks
    if optimizer.goal_clearance < 0.0:
        return stay(problem, f"blocked: the goal itself {_conflict_at_goal(problem)}")
    if at_goal := goal_fault(problem):
        return stay(problem, f"unreachable: at the goal itself, {at_goal}")
    candidates = sorted(optimizer.evaluate(seed_paths(problem, blocks)), key=lambda c: c.cost)
    candidates, grid_path = distinct(candidates, settings)[: settings.max_refined], None
    if candidates[0].shortfall > settings.grid_search_shortfall:
        if problem.moves.all() and not problem.spare_clearance:
            threaded = _search_trees(problem, optimizer, settings, time, settings.first_tree_growth)
            if threaded is not None and threaded.reached:
                return threaded
        grid_path = _search_grid(problem, optimizer, settings)
    if grid_path is not None and grid_path.reaches_goal:
        from_grid = optimizer.evaluate([block_displacements(grid_path.grips, blocks)])
        candidates = from_grid + candidates
    elif grid_path is not None:
        # No cheap guess leads through: the trees are tried before one is refined in vain.
        candidates = candidates[:1]
        proof = proof_of_no_path(problem)
        turned = None if proof else _search_trees(problem, optimizer, settings, time)
        if proof:
            return nearest_path(problem, optimizer, grid_path, candidates, proof, settings)
        if turned is not None and turned.reached:
            return turned
    best = best_path(problem, optimizer, candidates, settings, time)
    if best.reached:
        return best
    if (is_clear(best, optimizer) or best.arm_fault) and not time.is_over():
        seeker = optimizer if not best.arm_fault else avoiding_with_arms(problem, optimizer)
        more = sorted(seeker.evaluate(random_via_paths(problem, blocks)), key=lambda c: c.cost)
        if not best.arm_fault:
            # A rope with wrong properties misses its goal by the same distance on all paths.
            more = [c for c in more if c.error < settings.max_via_error_ratio * best.final_error]
        different = distinct(more, settings)[: settings.max_refined]
        around = [best_path(problem, seeker, different, settings, time)] if more else []
        best = max([best, *around], key=lambda path: rank(path, optimizer))
    proof = ""
    if not best.reached and (grid_path is None or grid_path.reaches_goal):
        proof = proof_of_no_path(problem) if grid_path is None else ""
        turned = None if proof else _search_trees(problem, optimizer, settings, time)
        best = max([best, turned or best], key=lambda path: rank(path, optimizer))
    if not is_clear(best, optimizer):
        grid_path = grid_path or _search_grid(problem, optimizer, settings)
        reason = proof or best.reason
        return nearest_path(problem, optimizer, grid_path, candidates, reason, settings)
    return best


def _search_trees(
    problem: Problem,
    optimizer: PathOptimizer,
    settings: PlannerSettings,
    time: PlanningTime,
    first_growth: int | None = None,
) -> WholePath | None:
    """Path along which the grips turn, by tree searches; None where they do not find any."""
    if not _is_rest_shape(problem, settings):
        return None
    low, high = np.array(problem.limits.workspace)
    ends = np.stack([grip.position for grip in problem.feasible_goal_grips])
    apart = grip_distance(problem.feasible_goal_grips)
    if np.any(ends < low) or np.any(ends > high) or apart > problem.longest_grip_distance:
        return None
    paths: list[WholePath] = []
    growth, clearances = TREE_SEARCH_SETTINGS, settings.tree_clearances
    if first_growth is not None:
        growth, clearances = replace(growth, max_iterations=first_growth), clearances[:1]
    refinement = replace(settings, iterations=settings.tree_iterations)
    for seed, share in enumerate(clearances):
        if time.is_over():
            break
        base = optimizer.necessary_clearance if seed else optimizer.wanted_clearance
        tree_path = TreeSearch(problem, share * base, seed, growth).run()
        if not tree_path.reaches_goal:
            continue
        lengths = tree_path.step_lengths
        finer = optimizer.settings.for_length(float(np.sum(lengths)))
        follower = PathOptimizer(problem, settings=finer)
        start = follower.follow(pose_displacements(tree_path.grips, lengths, finer.blocks))
        paths.append(refined_path(problem, follower, start, refinement))
        if paths[-1].reached and is_clear(paths[-1], optimizer):
            break
    return max(paths, key=lambda path: rank(path, optimizer), default=None)


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


def _search_grid(
    problem: Problem, optimizer: PathOptimizer, settings: PlannerSettings
) -> GridPath | None:
    """Path on the grid where both ends move, or the path to the nearest reachable shape."""
    if not problem.moves[:, :3].all():
        return None
    path = None
    for share in settings.grid_clearances:
        path = search_grid(problem, share * optimizer.wanted_clearance)
        if path.reaches_goal:
            break
    return path


def _conflict_at_goal(problem: Problem) -> str:
    """Words on the obstacle with which the goal overlaps most, or the region that it leaves."""
    worst = min(
        problem.obstacles,
        key=lambda o: geometry.chain_clearance(problem.goal.nodes, problem.radius, [o]),
    )
    return f"leaves region {worst.name!r}" if worst.keep_in else f"lies in obstacle {worst.name!r}"
