"""Plan of a whole path: seeds, grid search, optimisation, retiming, and choice of the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines
from lariat.rod import state_along
from services.planner.arms.arm_check import LEAST_LINK_MARGIN, goal_fault
from services.planner.grid_search.relaxation import proof_of_no_path
from services.planner.grid_search.search import GridPath, block_displacements, search_grid
from services.planner.landing import landed, landing
from services.planner.path_optimization.optimizer import PathCandidate, PathOptimizer
from services.planner.planning_time import PlanningTime
from services.planner.problem import Problem, WholePath, grip_distance
from services.planner.retiming import PATH_PERIOD, RETIMING_SETTINGS, required_clearance, retime
from services.planner.seeds import random_via_paths, seed_paths
from services.planner.tree_search.search import TreeSearch, pose_displacements
from services.planner.tree_search.settings import TREE_SEARCH_SETTINGS


@dataclass(frozen=True)
class PlannerSettings:
    """Effort of the planner."""

    iterations: int = 12
    """Largest number of Gauss-Newton iterations of a candidate."""
    wider_iterations: int = 5
    """Largest number of further iterations with a larger reserve."""
    reserve_per_shortfall: float = 1.3
    """Reserve that is added per clearance lost in motion [-]."""
    max_refined: int = 3
    """Largest number of candidates that are refined."""
    min_difference: float = 0.04
    """Distance of the grips halfway above which two candidates are different paths [m]."""
    grid_search_shortfall: float = 0.01
    """Shortfall of the best seed above which a path is searched on the grid [m]."""
    tree_clearances: tuple[float, ...] = (0.8, 0.5, 0.65)
    """Clearances of the tree searches in the order of trial: the first one relative to the wanted
    clearance, the others to the necessary one."""
    tree_iterations: int = 6
    """Largest number of Gauss-Newton iterations of a path that the trees found."""
    first_tree_growth: int = 10
    """Number of iterations of the trees before a path is searched on the grid, where both ends
    rotate: by then they have tried to lead the rope lengthwise through each narrow passage."""
    max_rest_error: float = 0.02
    """Mean node distance of the goal from a rest shape between its grips above which the trees are
    not tried, because the goal is not a shape that the rope takes [m]."""
    grid_clearances: tuple[float, ...] = (1.0, 0.4)
    """Clearances of the grid search, relative to the wanted one, in the order of trial."""
    max_parts: int = 8
    """Largest number of parts of blocked paths that are timed."""
    max_via_error_ratio: float = 0.7
    """Error of a random path, relative to that of the best path, below which it is refined."""


PLANNER_SETTINGS = PlannerSettings()
"""Default settings of the planner."""


def plan(problem: Problem, settings: PlannerSettings = PLANNER_SETTINGS) -> WholePath:
    """Return the best path found; its `reason` is empty when it reaches the goal.

    Args:
        problem: Planning problem.
        settings: Effort.
    """
    time = PlanningTime(problem.planning_time)
    found = landing(problem)
    if found is not None:
        approach = _plan(found.approach, settings, time)
        path = landed(problem, found, approach) if approach.reached else approach
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
        found = optimizer.evaluate([block_displacements(grid_path.grips, blocks)])
        candidates = found + candidates
    elif grid_path is not None:
        # No cheap guess leads through: the trees are tried before one is refined in vain.
        candidates = candidates[:1]
        proof = proof_of_no_path(problem)
        turned = None if proof else _search_trees(problem, optimizer, settings, time)
        if proof:
            return _nearest(problem, optimizer, grid_path, candidates, proof, settings)
        if turned is not None and turned.reached:
            return turned
    best = _best_path(problem, optimizer, candidates, settings, time)
    if best.reached:
        return best
    if (is_clear(best, optimizer) or best.arm_fault) and not time.is_over():
        seeker = optimizer if not best.arm_fault else _avoiding_with_arms(problem, optimizer)
        more = sorted(seeker.evaluate(random_via_paths(problem, blocks)), key=lambda c: c.cost)
        if not best.arm_fault:
            # A rope with wrong properties misses its goal by the same distance on all paths.
            more = [c for c in more if c.error < settings.max_via_error_ratio * best.final_error]
        different = distinct(more, settings)[: settings.max_refined]
        found = [_best_path(problem, seeker, different, settings, time)] if more else []
        best = max([best, *found], key=lambda path: _rank(path, optimizer))
    proof = ""
    if not best.reached and (grid_path is None or grid_path.reaches_goal):
        proof = proof_of_no_path(problem) if grid_path is None else ""
        turned = None if proof else _search_trees(problem, optimizer, settings, time)
        best = max([best, turned or best], key=lambda path: _rank(path, optimizer))
    if not is_clear(best, optimizer):
        grid_path = grid_path or _search_grid(problem, optimizer, settings)
        reason = proof or best.reason
        return _nearest(problem, optimizer, grid_path, candidates, reason, settings)
    return best


def _nearest(
    problem: Problem,
    optimizer: PathOptimizer,
    grid_path: GridPath | None,
    candidates: Sequence[PathCandidate],
    reason: str,
    settings: PlannerSettings,
) -> WholePath:
    """Path to the nearest shape that can be reached, where no path to the goal was found."""
    near = _nearest_reachable(problem, grid_path, reason, settings)
    return near or _clear_part(problem, optimizer, candidates, reason, settings)


def _search_trees(
    problem: Problem,
    optimizer: PathOptimizer,
    settings: PlannerSettings,
    time: PlanningTime,
    first_growth: int | None = None,
) -> WholePath | None:
    """Path along which the grips turn, by tree searches; None where they do not find any.

    Args:
        problem: Planning problem.
        optimizer: Optimiser of the problem, for its clearances.
        settings: Effort.
        time: Processor time of the plan.
        first_growth: Number of iterations of the first search, to which the effort is limited.
    """
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
        found = TreeSearch(problem, share * base, seed, growth).run()
        if not found.reaches_goal:
            continue
        lengths = found.step_lengths
        finer = optimizer.settings.for_length(float(np.sum(lengths)))
        follower = PathOptimizer(problem, settings=finer)
        start = follower.follow(pose_displacements(found.grips, lengths, finer.blocks))
        paths.append(refined_path(problem, follower, start, refinement))
        if paths[-1].reached and is_clear(paths[-1], optimizer):
            break
    return max(paths, key=lambda path: _rank(path, optimizer), default=None)


def _is_rest_shape(problem: Problem, settings: PlannerSettings) -> bool:
    """Whether the goal is near a shape that the rope takes between its grips."""
    left, right = problem.feasible_goal_grips
    guess = state_along(problem.goal, left.orientation, right.orientation)
    try:
        rest = problem.rod.rest(left, right, guess=guess, obstacles=problem.packed_supports)
    except ValueError:
        return False
    apart = polylines.mean_node_distance(rest.state.positions, problem.goal)
    return apart < settings.max_rest_error


def is_clear(path: WholePath, optimizer: PathOptimizer) -> bool:
    """Return whether a path is clear of obstacles, and the arms can go it.

    Args:
        path: Timed path.
        optimizer: Optimiser of its problem, for the clearance below which it is blocked.
    """
    least = required_clearance(optimizer) - RETIMING_SETTINGS.clearance_tolerance
    return path.clearance >= least and not path.arm_fault


def _avoiding_with_arms(problem: Problem, optimizer: PathOptimizer) -> PathOptimizer:
    """Optimizer that keeps the constraints of the arms, too."""
    return PathOptimizer(problem, optimizer.reserve, optimizer.settings, avoid_with_arms=True)


def _best_path(
    problem: Problem,
    optimizer: PathOptimizer,
    candidates: Sequence[PathCandidate],
    settings: PlannerSettings,
    time: PlanningTime,
) -> WholePath:
    """Best of the candidates' paths, or the first one with sufficient clearance."""
    sufficient = RETIMING_SETTINGS.sufficient_clearance * optimizer.wanted_clearance
    paths: list[WholePath] = []
    for candidate in candidates:
        paths.append(refined_path(problem, optimizer, candidate, settings))
        if paths[-1].reached and paths[-1].clearance > sufficient:
            return paths[-1]
        if candidate is not candidates[-1] and time.is_over():
            break
    return max(paths, key=lambda path: _rank(path, optimizer))


def _search_grid(
    problem: Problem, optimizer: PathOptimizer, settings: PlannerSettings
) -> GridPath | None:
    """Path on the grid where both ends move, or the path to the nearest reachable shape."""
    if not problem.moves[:, :3].all():
        return None
    found = None
    for share in settings.grid_clearances:
        found = search_grid(problem, share * optimizer.wanted_clearance)
        if found.reaches_goal:
            break
    return found


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
    wanted = optimizer.wanted_clearance - max(candidate.shortfall, 0.0)
    if path.clearance < wanted - RETIMING_SETTINGS.clearance_tolerance:
        # Smoothing and swing reduce the clearance: refine with a larger reserve.
        lack = settings.reserve_per_shortfall * (wanted - path.clearance)
        reserve = optimizer.settings.clearance_reserve + lack
        wider = PathOptimizer(problem, reserve, optimizer.settings)
        again = wider.refine(wider.allow_for_uncertainty(candidate), settings.wider_iterations)
        found = retime(problem, wider, again)
        path = max(path, found, key=lambda p: _rank(p, optimizer))
    if path.arm_fault:
        around = _avoiding_with_arms(problem, optimizer)
        again = around.refine(around.reevaluate(candidate), settings.iterations)
        found = retime(problem, around, again, link_margin=LEAST_LINK_MARGIN)
        path = max(path, found, key=lambda p: _rank(p, optimizer))
    return path


def _nearest_reachable(
    problem: Problem, grid_path: GridPath | None, reason: str, settings: PlannerSettings
) -> WholePath | None:
    """Path to the shape nearest to the goal that the grid search found without collision."""
    if grid_path is None or grid_path.reaches_goal or len(grid_path.grips) < 2:
        return None
    near = replace(
        problem,
        goal=grid_path.end_nodes,
        goal_grips=grid_path.end_grips,
        oriented=(False, False),
    )
    optimizer = PathOptimizer(near)
    displacements = block_displacements(grid_path.grips, optimizer.settings.blocks)
    path = refined_path(near, optimizer, optimizer.evaluate([displacements])[0], settings)
    if not is_clear(path, optimizer) or path.clearance < 0.0:
        return None
    return _ending_short(
        problem,
        path,
        f"{reason}; the nearest shape that can be reached is {{left_mm:.0f}} mm from the goal on "
        "average",
    )


def _clear_part(
    problem: Problem,
    optimizer: PathOptimizer,
    candidates: Sequence[PathCandidate],
    reason: str,
    settings: PlannerSettings,
) -> WholePath:
    """Clear part of a path that ends nearest to the goal; what is seen there may help."""
    least = required_clearance(optimizer)
    stride = optimizer.settings.steps_per_block
    here = problem.goal_error(problem.state.positions)
    parts = []
    for start in candidates:
        candidate = optimizer.refine(start, settings.iterations)
        at_blocks = candidate.nodes[stride - 1 :: stride][: len(candidate.displacements)]
        for count, nodes in enumerate(at_blocks, start=1):
            if geometry.chain_clearance(nodes, problem.radius, problem.obstacles) < least:
                break
            left = problem.goal_error(nodes)
            if left < here:
                parts.append((left, count, candidate, nodes))
    for _, count, candidate, nodes in sorted(parts, key=lambda part: part[0])[: settings.max_parts]:
        displacements = candidate.displacements.copy()
        displacements[count:] = 0.0
        near = replace(problem, goal=nodes, oriented=(False, False))
        shorter = PathOptimizer(near)
        path = retime(near, shorter, shorter.follow(displacements))
        if path.clearance >= least and not path.arm_fault:
            return _ending_short(
                problem, path, f"{reason}; a part of it ends {{left_mm:.0f}} mm from the goal"
            )
    return stay(problem, reason)


def _ending_short(problem: Problem, path: WholePath, reason: str) -> WholePath:
    """Path that is blocked, with the distance that is left in its reason."""
    left = problem.goal_error(path.nodes[-1])
    reason = reason.format(left_mm=1e3 * left)
    return replace(path, reached=False, reason=reason, final_error=left, blocked=True)


def stay(problem: Problem, reason: str) -> WholePath:
    """Return a path that stays at the start.

    Args:
        problem: Planning problem.
        reason: Reason why no path reaches the goal.
    """
    positions = np.stack([[g.position for g in problem.grips]] * 2)
    orientations = np.stack([[g.orientation for g in problem.grips]] * 2)
    here = problem.state.positions
    left = problem.goal_error(here)
    own = geometry.chain_clearance(here, problem.radius, problem.obstacles)
    nodes = np.repeat(here[None], 2, axis=0)
    return WholePath(
        PATH_PERIOD, positions, orientations, nodes, False, reason, left, own, blocked=True
    )


def _conflict_at_goal(problem: Problem) -> str:
    """Words on the obstacle with which the goal overlaps most, or the region that it leaves."""
    worst = min(
        problem.obstacles,
        key=lambda o: geometry.chain_clearance(problem.goal, problem.radius, [o]),
    )
    return f"leaves region {worst.name!r}" if worst.keep_in else f"lies in obstacle {worst.name!r}"


def _rank(path: WholePath, optimizer: PathOptimizer) -> tuple[bool, bool, float]:
    """Sort key: reached, then clear, then clearance or nearness to the goal."""
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
