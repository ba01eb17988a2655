"""Proof that there is no path: a ball as large as a gripper's end cannot come to the goal.

Each grip is the centre of a ball that must not touch an obstacle, whatever the rope does, and stays
in the regions that the rope is kept in. A cell of
the grid is free if any place in it may be free, and neighbouring free cells are connected: where
the goal's cell is not connected with the start's, no path of the grips exists in the workspace. The
converse does not hold.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.obstacles import scene_distance
from lariat.planning.problem import Problem
from lariat.scenario import SIDES

MAX_DISTANCES = 2_000_000
"""Largest number of distances of cells from obstacles; a coarser grid proves less."""
MAX_CELLS = 800_000
"""Largest number of cells."""
SPACING_SHARE = 0.7
"""Spacing at which a wall shows, relative to the ball's radius and half the wall's width [-]."""


def proof_of_no_path(problem: Problem) -> str:
    """Return the reason why no path to the goal exists; empty where there may be one."""
    limits = problem.limits
    low, high = np.array(limits.workspace)
    whole = limits.gripper_radius + limits.keep_out
    spacing, distances, inside = _distances(problem, whole)
    for end, pair in enumerate(zip(problem.grips, problem.goal.grips, strict=True)):
        ends = np.stack([grip.position for grip in pair])
        if not problem.moves[end, :3].any() or np.any(ends < low) or np.any(ends > high):
            continue
        radius = min(whole, float(scene_distance(ends, problem.solid).min()))
        half = 0.5 * np.sqrt(3.0) * spacing
        free = distances + half >= radius
        # The grip holds the rope's end, which stays in the regions where start and goal are.
        free &= inside + half >= min(0.0, float(scene_distance(ends, problem.regions).min()))
        index = np.clip(((ends - low) / spacing).astype(int), 0, np.array(free.shape) - 1)
        now, goal = (tuple(cell) for cell in index.tolist())
        if not _connected(free, now)[goal]:
            return (
                f"blocked: there is no path: no place for the {SIDES[end]} gripper, "
                f"{2e3 * radius:.0f} mm wide with its distance, connects start and goal"
            )
    return ""


def _distances(
    problem: Problem, radius: float
) -> tuple[float, Float64[np.ndarray, "x y z"], Float64[np.ndarray, "x y z"]]:
    """Spacing of the cells, and the distances of their centres from obstacles and regions [m]."""
    low, high = np.array(problem.limits.workspace)
    thinnest = min((o.thickness for o in problem.solid), default=np.inf)
    finest = SPACING_SHARE * (radius + 0.5 * min(thinnest, 1.0))
    most = min(MAX_DISTANCES / max(len(problem.solid), 1), MAX_CELLS)
    spacing = max(finest, float(np.prod(high - low) / most) ** (1.0 / 3.0))
    size = np.maximum(np.ceil((high - low) / spacing).astype(int), 1)
    axes = [low[k] + spacing * (np.arange(size[k]) + 0.5) for k in range(3)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    bodies, regions = problem.solid, problem.regions
    return spacing, scene_distance(centres, bodies), scene_distance(centres, regions)


def _connected(
    free: Bool[np.ndarray, "x y z"], start: tuple[int, ...]
) -> Bool[np.ndarray, "x y z"]:
    """Free cells that are connected with one of them through faces."""
    reached = np.zeros(free.shape, dtype=bool)
    reached[start] = True
    count = 0
    while count != (count := int(reached.sum())):
        for axis in range(3):
            there, open_there = (np.moveaxis(cells, axis, 0) for cells in (reached, free))
            there[1:] |= there[:-1] & open_there[1:]
            there[:-1] |= there[1:] & open_there[:-1]
    return reached
