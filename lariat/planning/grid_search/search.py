"""Search for a path through narrow places on a grid.

The rope is carried in a few fixed shapes: the current one, the goal shape, and shapes stretched
between grips at several distances and headings. A carried shape does not rotate, so its place has
three coordinates. A wave runs from the start through all places that keep their clearance, in all
shapes at once; at any place one shape may change into another. The result is a rough initial guess
for the optimisation; where the wave ends before the goal, there is no such path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int16

from lariat.geometry.poses import Pose
from lariat.planning.grid_search.carried_shapes import CarriedShape, carried_shapes, middle_of
from lariat.planning.grid_search.distance_grid import DistanceGrid
from lariat.planning.grid_search.settings import GridSearchSettings
from lariat.planning.grid_search.wavefront import Cell, backtrack, propagate, shortcut
from lariat.planning.problem import Problem


@dataclass(frozen=True)
class GridPath:
    """Path found on the grid."""

    reaches_goal: bool
    """Whether it leads to the goal."""
    grips: Float64[np.ndarray, "w 2 3"]
    """Waypoints of both grips from the start to the goal, or to the nearest reachable shape [m]."""
    end_grips: tuple[Pose, Pose]
    """Grips at its end."""
    end_nodes: Float64[np.ndarray, "n 3"]
    """Nodes at its end [m]."""


def search_grid(
    problem: Problem, clearance: float, settings: GridSearchSettings | None = None
) -> GridPath:
    """Return the shortest path in carried shapes that keeps a clearance.

    Args:
        problem: Start, goal and obstacles.
        clearance: Clearance along the path, start and goal excepted [m].
        settings: Resolution, extent and shapes.
    """
    settings = settings or GridSearchSettings()
    shapes = carried_shapes(problem, settings)
    grid = DistanceGrid.around(problem, shapes, settings)
    free = np.stack(
        [grid.free_places(problem, shape, clearance, settings.max_nodes) for shape in shapes]
    )
    start = (0, *grid.place(middle_of(problem.grips)))
    goal = (1, *grid.place(middle_of(problem.goal.grips)))
    free[start] = True
    # Start and goal may be nearer to obstacles than the path.
    free[goal] = True
    reached_at = propagate(free, start, goal)
    reaches_goal = reached_at[goal] >= 0
    end = goal if reaches_goal else _nearest_to_goal(problem, shapes, grid, reached_at)
    cells = shortcut(backtrack(reached_at, end), free)
    grips = np.stack([grid.position(cell) + shapes[cell[0]].grips for cell in cells])
    grips[0] = np.stack([g.position for g in problem.grips])
    if end == goal:
        grips[-1] = np.stack([g.position for g in problem.goal.grips])
        return GridPath(True, grips, problem.goal.grips, problem.goal.nodes)
    shape = shapes[end[0]]
    left, right = (Pose(p, q) for p, q in zip(grips[-1], shape.orientations, strict=True))
    return GridPath(False, grips, (left, right), grid.position(end) + shape.nodes)


def block_displacements(
    waypoints: Float64[np.ndarray, "w 2 3"], blocks: int
) -> Float64[np.ndarray, "k 2 3"]:
    """Return waypoints as displacements in blocks, with more blocks for longer legs [m].

    Args:
        waypoints: Positions of both grips [m].
        blocks: Number of blocks.
    """
    lengths = np.linalg.norm(np.diff(waypoints, axis=0), axis=2).max(axis=1)
    legs = len(lengths)
    if legs >= blocks:
        at = np.linspace(0.0, legs, blocks + 1)
    else:
        shares = np.ones(legs, dtype=int)
        for _ in range(blocks - legs):
            shares[np.argmax(lengths / shares)] += 1
        at = np.concatenate(
            [[0.0], *(k + np.arange(1, s + 1) / s for k, s in enumerate(shares.tolist()))]
        )
    flat = waypoints.reshape(len(waypoints), 6)
    positions = [np.interp(at, np.arange(legs + 1), column) for column in flat.T]
    return np.diff(np.stack(positions, axis=1), axis=0).reshape(blocks, 2, 3)


def _nearest_to_goal(
    problem: Problem,
    shapes: Sequence[CarriedShape],
    grid: DistanceGrid,
    reached_at: Int16[np.ndarray, "s x y z"],
) -> Cell:
    """Reached cell whose shape is nearest to the goal."""
    best, least = (0, *grid.place(middle_of(problem.grips))), np.inf
    positions = grid.positions
    for index, shape in enumerate(shapes):
        reached = reached_at[index] >= 0
        if not reached.any():
            continue
        offset = problem.goal.nodes - shape.nodes
        # The mean square distance over the nodes splits into that of their mean, and a constant.
        middle = offset.mean(axis=0)
        spread = float(np.mean(np.sum((offset - middle) ** 2, axis=1)))
        distance = np.sum((positions - middle) ** 2, axis=-1) + spread
        distance = np.where(reached, distance, np.inf)
        flat = int(np.argmin(distance))
        if distance.flat[flat] < least:
            least = float(distance.flat[flat])
            x, y, z = np.unravel_index(flat, distance.shape)
            best = (index, int(x), int(y), int(z))
    return best
