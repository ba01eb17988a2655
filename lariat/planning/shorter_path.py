"""Paths that end short of a goal which none was found to: at the nearest shape, or on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lariat.geometry import obstacles as geometry
from lariat.geometry.grips import Grips
from lariat.planning.path_optimization.block_path import BLOCKS, STEPS_PER_BLOCK
from lariat.planning.path_optimization.optimizer import PathCandidate, PathOptimizer
from lariat.planning.problem import Problem, WholePath
from lariat.planning.refinement import ITERATIONS, followed, is_clear, refined_path
from lariat.planning.retiming import retime
from lariat.planning.tree_search.search import TreePath

MAX_PARTS = 8
"""Largest number of parts of blocked paths that are timed."""


def nearest_path(
    problem: Problem,
    tree_path: TreePath | None,
    candidates: Sequence[PathCandidate],
    reason: str,
) -> WholePath:
    """Return a path to the nearest shape that the trees reached, or along a clear part."""
    near = _nearest_reachable(problem, tree_path, reason)
    return near or _clear_part(problem, candidates, reason)


def _nearest_reachable(
    problem: Problem, tree_path: TreePath | None, reason: str
) -> WholePath | None:
    """Path to the shape nearest to the goal that the trees reached."""
    if tree_path is None or tree_path.reaches_goal:
        return None
    _, candidate = followed(problem, tree_path)
    left, right = tree_path.grips.pair(-1)
    near = problem.with_goal(
        nodes=candidate.nodes[-1],
        left=left,
        right=right,
        left_oriented=False,
        right_oriented=False,
    )
    optimizer, start = followed(near, tree_path)
    path = refined_path(optimizer, start)
    if not is_clear(path, optimizer) or path.clearance < 0.0:
        return None
    return _ending_short(
        problem,
        path,
        f"{reason}; the nearest shape found that can be reached is {{left_mm:.0f}} mm from the "
        "goal on average",
    )


def _clear_part(problem: Problem, candidates: Sequence[PathCandidate], reason: str) -> WholePath:
    """Clear part of a path that ends nearest to the goal; what is seen there may help."""
    optimizer = PathOptimizer(problem)
    least = optimizer.required_clearance
    here = problem.goal_error(problem.state.positions)
    parts = []
    for start in candidates:
        candidate = optimizer.refine(start, ITERATIONS)
        at_blocks = candidate.nodes[STEPS_PER_BLOCK - 1 :: STEPS_PER_BLOCK][:BLOCKS]
        for count, nodes in enumerate(at_blocks, start=1):
            if geometry.chain_clearance(nodes, problem.radius, problem.obstacles) < least:
                break
            left = problem.goal_error(nodes)
            if left < here:
                parts.append((left, count, candidate, nodes))
    for _, count, candidate, nodes in sorted(parts, key=lambda part: part[0])[:MAX_PARTS]:
        displacements = candidate.displacements.copy()
        displacements[count:] = 0.0
        near = problem.with_goal(nodes=nodes, left_oriented=False, right_oriented=False)
        shorter = PathOptimizer(near)
        path = retime(shorter, shorter.follow(displacements))
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
    """Return a path that stays at the start."""
    grips = Grips.of(problem.grips, problem.grips)
    here = problem.state.positions
    left = problem.goal_error(here)
    own = geometry.chain_clearance(here, problem.radius, problem.obstacles)
    nodes = np.repeat(here[None], 2, axis=0)
    return WholePath(
        grips.positions, grips.orientations, nodes, False, reason, left, own, blocked=True
    )
