"""A whole path: the best of several ways, put on a clock and checked with the rod in motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines
from services.planner.dynamic_check import DT, ENOUGH, SLACK, least_clearance, on_the_clock
from services.planner.grid_search import Corridor, corridor, displacements
from services.planner.path_optimization import RESERVE, PathOptimisation, Trial
from services.planner.problem import Problem, WholePath
from services.planner.seeds import others, starts

ITERATIONS = 12
MORE_ITERATIONS = 5
NEARER = 0.7
"""Share of the distance that is left, below which another shape is worth refining."""
TRIES = 3
"""Ways that are refined, at most."""


LOST = 0.01
"""When even the best first guess lacks so much clearance, a way is sought on a grid [m]."""
NARROWER = (1.0, 0.4)
"""Shares of the wanted clearance with which it is sought."""


def plan(problem: Problem) -> WholePath:
    """The best path found; its `reason` says what is wrong when it does not reach the goal."""
    optimisation = PathOptimisation(problem)
    blocks = len(optimisation.turn)
    if optimisation.goal_clearance < 0.0:
        return _standing(problem, f"blocked: the goal itself lies in {_culprit(problem)}")
    candidates = sorted(optimisation.trials(starts(problem, blocks)), key=lambda t: t.cost)
    candidates, sought = _different(candidates)[:TRIES], None
    if candidates[0].shortfall > LOST:
        sought = _sought(problem, optimisation)
    if sought is not None and sought.open:
        candidates = optimisation.trials([displacements(sought.grips, blocks)]) + candidates
    elif sought is not None:
        candidates = candidates[:1]
    best = _best(problem, optimisation, candidates)
    if best.clearance < least_clearance(optimisation) - SLACK:
        return _as_near_as_can_be(problem, sought or _sought(problem, optimisation), best.reason)
    if not best.reached:
        more = sorted(optimisation.trials(others(problem, blocks)), key=lambda t: t.cost)
        # A rope that is not what it is believed to be is off its goal in all ways alike.
        more = [t for t in more if t.error < NEARER * best.final_error]
        found = [_best(problem, optimisation, _different(more)[:TRIES])] if more else []
        best = max([best, *found], key=lambda path: _worth(path, optimisation))
    return best


def _best(
    problem: Problem, optimisation: PathOptimisation, candidates: Sequence[Trial]
) -> WholePath:
    """Of the paths that first guesses lead to; the first that is good enough."""
    paths: list[WholePath] = []
    for candidate in candidates:
        paths.append(_refined(problem, optimisation, candidate))
        if paths[-1].reached and paths[-1].clearance > ENOUGH * optimisation.wanted:
            return paths[-1]
    return max(paths, key=lambda path: _worth(path, optimisation))


def _sought(problem: Problem, optimisation: PathOptimisation) -> Corridor | None:
    """A way on the grid, where both ends move; its nearest end where there is none."""
    if not problem.moves[:, :3].all():
        return None
    found = None
    for share in NARROWER:
        found = corridor(problem, share * optimisation.wanted)
        if found.open:
            break
    return found


def _refined(problem: Problem, optimisation: PathOptimisation, start: Trial) -> WholePath:
    """The path that a first guess leads to."""
    trial = optimisation.refined(start, ITERATIONS)
    path = on_the_clock(problem, optimisation, trial)
    wanted = optimisation.wanted - max(trial.shortfall, 0.0)
    if path.clearance < wanted - SLACK:
        # Rounding the corners and swinging took from the clearance: ask for more of it.
        wider = PathOptimisation(problem, RESERVE + 1.3 * (wanted - path.clearance))
        again = wider.refined(wider.again(trial), MORE_ITERATIONS)
        found = on_the_clock(problem, wider, again)
        path = max(path, found, key=lambda p: _worth(p, optimisation))
    return path


def _as_near_as_can_be(problem: Problem, sought: Corridor | None, reason: str) -> WholePath:
    """The path to the shape nearest to the goal that can be reached without touching anything."""
    if sought is None or sought.open or len(sought.grips) < 2:
        return _standing(problem, reason)
    near = replace(problem, goal=sought.nodes, goal_grips=sought.ends, oriented=(False, False))
    optimisation = PathOptimisation(near)
    way = displacements(sought.grips, len(optimisation.turn))
    path = _refined(near, optimisation, optimisation.trials([way])[0])
    if path.clearance < least_clearance(optimisation) - SLACK:
        return _standing(problem, reason)
    left = polylines.mean_node_distance(path.nodes[-1], problem.goal)
    reason = (
        "blocked: no way to the goal was found; the nearest shape that can be reached is "
        f"{1e3 * left:.0f} mm from it on average"
    )
    return replace(path, reached=False, reason=reason, final_error=left, blocked=True)


def _standing(problem: Problem, reason: str) -> WholePath:
    """Stays here."""
    positions = np.stack([[g.position for g in problem.grips]] * 2)
    orientations = np.stack([[g.orientation for g in problem.grips]] * 2)
    here = problem.state.positions
    left = polylines.mean_node_distance(here, problem.goal)
    own = geometry.chain_clearance(here, problem.radius, problem.obstacles)
    nodes = np.repeat(here[None], 2, axis=0)
    return WholePath(DT, positions, orientations, nodes, False, reason, left, own, blocked=True)


def _culprit(problem: Problem) -> str:
    """The obstacle that the goal lies in."""
    worst = min(
        problem.obstacles,
        key=lambda o: geometry.chain_clearance(problem.goal, problem.radius, [o]),
    )
    return f"obstacle {worst.name!r}"


def _worth(path: WholePath, optimisation: PathOptimisation) -> tuple[bool, bool, float]:
    clear = path.clearance >= least_clearance(optimisation) - SLACK
    counts = path.clearance if path.reached or not clear else -path.final_error
    return path.reached, clear, counts


def _different(trials: list[Trial]) -> list[Trial]:
    """Trials whose ways differ halfway, in their order."""
    kept: list[Trial] = []
    for trial in trials:
        if all(np.max(np.abs(_halfway(trial) - _halfway(k))) > 0.04 for k in kept):
            kept.append(trial)
    return kept


def _halfway(trial: Trial) -> Float64[np.ndarray, "2 3"]:
    half = len(trial.displacements) // 2
    return np.sum(trial.displacements[:half, :, :3], axis=0)
