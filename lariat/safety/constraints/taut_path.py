"""Paths that are pulled tight around obstacles.

A taut path is straight but for a few corners, each at an obstacle. A path is pulled tight by moving
its corners to where springs in place of its lines would pull them, all together and sliding along
the obstacles, and by leaving out those that nothing holds. A few rounds suffice for a path that was
tight before its ends moved; one that is far from tight becomes shorter. It stays outside at every
step, so that its length is never below the shortest one except for what a line may cut into a solid
(`line_of_sight`).
"""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.safety.constraints.line_of_sight import LineOfSight

STEPS = np.array([1.0, 0.5, 0.25, 0.1, 0.03])
"""Parts of the way to the rest of the springs by which the corners are tried to move [-]."""
ROUNDS = 5
"""Largest number of rounds; before the first, corners are divided, as one may become several."""
MAX_DIVIDED = 14
"""Number of points up to which corners are divided."""
MAX_MOVED = 40
"""Number of points up to which corners are moved, which bounds the work of a step."""
MAX_LEFT_OUT = 32
"""Number of points that are tried to be left out in a step."""
MOVE_STEPS = 3
"""Steps that a move of the corners counts for."""
TOUCHING = 1e-3
"""Distance from a solid up to which a corner slides along it [m]."""
EDGE_WIDTH = 1e-4
"""Distance from a second face up to which a point of a face is at their edge [m]."""
DIVISION = 0.3
"""Place of the new corners on the lines beside one, relative to their lengths [-]."""
LEAST_GAIN = 1e-4
"""Length gained in a round below which the path is tight [m]."""
NORMAL_STEP = 1e-5
"""Step of the central differences for a solid's normal [m]."""

Vertices = Float64[np.ndarray, "n 3"]


def string_pulled(points: Vertices, sight: LineOfSight) -> Generator[int, None, Vertices]:
    """Yield after each part how many steps of 0.1 ms it took; return ends and corners when taut.

    Args:
        points: Points of a path whose lines nothing cuts [m].
        sight: Lines of sight of its scene.
    """
    corners = yield from _left_out(points, sight)
    length = polylines.length(corners)
    for n in range(ROUNDS):
        if n == 0 and len(corners) <= MAX_DIVIDED:
            corners = _divided(corners)
        if len(corners) > MAX_MOVED:
            break
        for along_edges in (True, False):
            corners = _moved(corners, sight, along_edges)
            yield MOVE_STEPS
        corners = yield from _left_out(corners, sight)
        before, length = length, polylines.length(corners)
        if n > 0 and before - length < LEAST_GAIN:
            break
    return corners


def without_needless(points: Vertices, sight: LineOfSight) -> Vertices:
    """Return a path without the points that it need not pass."""
    leaving = _left_out(points, sight)
    while True:
        try:
            next(leaving)
        except StopIteration as end:
            corners: Vertices = end.value
            return corners


def _left_out(points: Vertices, sight: LineOfSight) -> Generator[int, None, Vertices]:
    """Yield after each step; return the path on which the farthest point that is seen is next."""
    kept, at, last = [points[0]], 0, len(points) - 1
    while at < last:
        rest = points[at + 1 : at + 1 + MAX_LEFT_OUT]
        seen = sight.strict.clear(np.repeat(points[at][None], len(rest), axis=0), rest)
        # Up to the first that is hidden: what is seen behind it may be on the other side.
        hidden = np.flatnonzero(~seen)
        at += max(int(hidden[0]) if len(hidden) else len(rest), 1)
        kept.append(points[at])
        yield 1
    return np.array(kept)


def _divided(corners: Vertices) -> Vertices:
    """Return a path with two more points beside each corner."""
    inner = corners[1:-1]
    before = inner + DIVISION * (corners[:-2] - inner)
    behind = inner + DIVISION * (corners[2:] - inner)
    between = np.stack([before, inner, behind], axis=1).reshape(-1, 3)
    return np.concatenate([corners[:1], between, corners[-1:]])


def _moved(corners: Vertices, sight: LineOfSight, along_edges: bool) -> Vertices:
    """Return a path whose corners have slid along their solids as far as all of them can at once.

    The springs in place of the lines are as stiff as these are short, so that at rest their forces
    are those of a taut line.

    Args:
        corners: Ends and corners of the path [m].
        sight: Lines of sight of its scene.
        along_edges: Whether corners at an edge stay there; otherwise they may leave it.
    """
    count = len(corners) - 2
    near = np.flatnonzero(sight.scene.touched(corners[:-1], corners[1:]).any(axis=0))
    if not count or not len(near):
        return corners
    lengths = np.maximum(np.linalg.norm(np.diff(corners, axis=0), axis=1), 1e-4)
    springs = 1.0 / lengths
    matrix = np.zeros((count, count + 2))
    rows = np.arange(count)
    matrix[rows, rows], matrix[rows, rows + 2] = -springs[:-1], -springs[1:]
    matrix[rows, rows + 1] = springs[:-1] + springs[1:]
    free = _free_directions(corners[1:-1], near, sight, along_edges)
    # Displacements along the other directions are zero.
    stiffness = np.einsum("iab,jbc->iajc", free, free) * matrix[:, None, 1:-1, None]
    stiffness[rows, :, rows] += np.eye(3) - free
    forces = -np.einsum("iab,ib->ia", free, matrix @ corners)
    size = 3 * count
    way = np.linalg.solve(stiffness.reshape(size, size), forces.ravel()).reshape(count, 3)
    tried = np.repeat(corners[None], len(STEPS), axis=0)
    moved = corners[1:-1] + STEPS[:, None, None] * way
    tried[:, 1:-1] = pushed_out(moved.reshape(-1, 3), near, sight).reshape(moved.shape)
    moved_lengths = np.linalg.norm(np.diff(tried, axis=1), axis=2).sum(axis=1)
    clear = sight.clear(tried[:, :-1].reshape(-1, 3), tried[:, 1:].reshape(-1, 3))
    moved_lengths[~clear.reshape(len(STEPS), -1).all(axis=1)] = np.inf
    best = int(np.argmin(moved_lengths))
    return tried[best] if moved_lengths[best] < lengths.sum() else corners


def _free_directions(
    points: Vertices, near: Int64[np.ndarray, "k"], sight: LineOfSight, along_edges: bool
) -> Float64[np.ndarray, "n 3 3"]:
    """Return the projections on the directions in which points slide along solids they touch."""
    gaps = np.array([signed_distance(points, sight.cores[k]) - sight.depths[k] for k in near])
    nearest = np.argmin(gaps, axis=0)
    free = np.tile(np.eye(3), (len(points), 1, 1))
    for n in sorted(set(nearest.tolist())):
        rows = np.flatnonzero((nearest == n) & (gaps[n] < TOUCHING))
        core = sight.cores[near[n]]
        if not len(rows):
            continue
        blocked = normals(points[rows], core)[:, None]
        faces = core.row.faces(core.packed_sizes, core.local(points[rows]))
        if along_edges and faces is not None:
            axes, beyond = faces
            turn = poses.matrix(np.array(core.orientation))
            blocked = (axes * (beyond > -EDGE_WIDTH)[:, :, None]) @ turn.T
        free[rows] -= np.einsum("nka,nkb->nab", blocked, blocked)
    return free


def pushed_out(points: Vertices, near: Int64[np.ndarray, "k"], sight: LineOfSight) -> Vertices:
    """Return points, those inside a solid moved to its surface, whose edges are round for them.

    Args:
        points: Points [m].
        near: Numbers of the solids that count.
        sight: Lines of sight of their scene.
    """
    for k in near:
        # Round edges have a normal everywhere, along which a corner can slide.
        missing = sight.depths[k] - signed_distance(points, sight.cores[k])
        inside = missing > 0.0
        if np.any(inside):
            points = points.copy()
            points[inside] += missing[inside, None] * normals(points[inside], sight.cores[k])
    return points


def normals(points: Vertices, obstacle: Obstacle) -> Vertices:
    """Return the outward unit normals of an obstacle at points.

    Args:
        points: Points [m].
        obstacle: The obstacle.
    """
    shifted = points[:, None] + NORMAL_STEP * np.concatenate([np.eye(3), -np.eye(3)])
    d = signed_distance(shifted, obstacle)
    gradients = d[:, :3] - d[:, 3:]
    return gradients / np.maximum(np.linalg.norm(gradients, axis=1, keepdims=True), 1e-12)
