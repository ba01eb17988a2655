"""Wavefront search over cells: places, times the shapes in which the rope may be there."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Int16

Cell = tuple[int, int, int, int]
"""Index of a carried shape, then of a place along x, y and z."""
MAX_STEPS = 2000
"""Number of steps after which the wave stops."""
UNREACHED = -1
"""Step of cells that the wave has not reached."""

_NEIGHBOUR_MOVES = [
    tuple(int(s) * int(k == axis) for k in range(4)) for axis in (1, 2, 3) for s in (-1, 1)
]


def propagate(
    free: Bool[np.ndarray, "s x y z"], start: Cell, goal: Cell
) -> Int16[np.ndarray, "s x y z"]:
    """Return the step at which a wave from the start first reaches each cell.

    A step leads to a neighbouring place, in any of the shapes that are free there.

    Args:
        free: Cells that keep their clearance.
        start: Cell of the start.
        goal: Cell at which the wave may stop.
    """
    reached_at = np.full(free.shape, UNREACHED, dtype=np.int16)
    front = np.zeros(free.shape, dtype=bool)
    front[start] = True
    reached_at[start] = 0
    unvisited = free.copy()
    unvisited[start] = False
    for step in range(1, MAX_STEPS):
        near = np.broadcast_to(front.any(axis=0), front.shape).copy()
        for axis in (1, 2, 3):
            ahead = [slice(None)] * 4
            behind = [slice(None)] * 4
            ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
            near[tuple(ahead)] |= front[tuple(behind)]
            near[tuple(behind)] |= front[tuple(ahead)]
        front = near & unvisited
        if not front.any():
            break
        unvisited &= ~front
        reached_at[front] = step
        if front[goal]:
            break
    return reached_at


def backtrack(reached_at: Int16[np.ndarray, "s x y z"], end: Cell) -> list[Cell]:
    """Return the cells from the start to a reached one; directions are kept where possible."""
    cells = [end]
    last = (0, 0, 0, 0)
    while reached_at[cells[-1]] > 0:
        here = cells[-1]
        distance = reached_at[here] - 1
        moves = [last, *_NEIGHBOUR_MOVES]
        candidates = [tuple(a + b for a, b in zip(here, move, strict=True)) for move in moves]
        candidates += [(shape, *here[1:]) for shape in range(reached_at.shape[0])]
        for candidate in candidates:
            inside = all(0 <= p < n for p, n in zip(candidate, reached_at.shape, strict=True))
            if inside and reached_at[candidate] == distance:
                last = tuple(b - a for a, b in zip(here, candidate, strict=True))
                cells.append(candidate)
                break
    return cells[::-1]


def shortcut(cells: list[Cell], free: Bool[np.ndarray, "s x y z"]) -> list[Cell]:
    """Return the same path with straight legs wherever both end shapes are free along the leg."""
    kept = [cells[0]]
    at = 0
    while at < len(cells) - 1:
        ahead = next(
            k
            for k in range(len(cells) - 1, at, -1)
            if k == at + 1 or _line_is_free(cells[at], cells[k], free)
        )
        kept.append(cells[ahead])
        at = ahead
    return [a for a, b in pairwise(kept) if a != b] + [kept[-1]]


def _line_is_free(one: Cell, other: Cell, free: Bool[np.ndarray, "s x y z"]) -> bool:
    """Whether both cells' shapes are free on the straight line between their places."""
    a, b = np.array(one[1:]), np.array(other[1:])
    count = 2 * int(np.max(np.abs(b - a))) + 1
    places = np.round(a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)).astype(int)
    inner = places[1:-1]
    x, y, z = inner.T
    return bool(np.all(free[one[0], x, y, z]) and np.all(free[other[0], x, y, z]))
