"""A way through narrow places, sought on a grid.

The rope is carried in a few held shapes: as it hangs now, as it shall hang, and stretched between
grips at several distances and headings. A held shape moves without turning, so where it can be has
three coordinates. A wave runs from the start through all places that keep their distance, in all
shapes at once; at any place one shape may become another. What it finds is rough, a first guess for
the optimisation; where it ends says that there is no way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float64, Int16

from lariat.geometry import poses
from lariat.geometry.grippers import gripper_points
from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.geometry.poses import Pose
from services.planner.problem import Problem

SPACING = 0.025
"""Of the grid [m]; wider where the rope is longer than `USUAL`."""
USUAL = 0.6
"""Length of a rope for that spacing [m]."""
AROUND = 0.30
"""Of start and goal that is searched [m], and the height above the obstacles, for that length."""
TAUT = (0.93, 0.7, 0.5, 0.35)
"""Distances of the grips in held shapes, as fractions of the rope's length."""
ALIKE = 0.2
"""Headings nearer than this are one [rad]."""
POINTS = 24
"""Of the rope that are looked at, at most."""
Cell = tuple[int, int, int, int]
"""Index of a held shape, then of a place."""


@dataclass(frozen=True)
class Held:
    """A shape in which the rope is carried; places are relative to the middle of the grips."""

    grips: Float64[np.ndarray, "2 3"]
    """[m]"""
    orientations: Float64[np.ndarray, "2 4"]
    """Of the grips, wxyz."""
    nodes: Float64[np.ndarray, "n 3"]
    """[m]"""
    bodies: Float64[np.ndarray, "6 3"]
    """Points on the grippers' axes [m]."""


@dataclass(frozen=True)
class Corridor:
    """What the search found."""

    open: bool
    """Whether a way leads to the goal."""
    grips: Float64[np.ndarray, "w 2 3"]
    """Way-points of both grips from here to the goal, or to the nearest place that can be reached
    [m]."""
    ends: tuple[Pose, Pose]
    """The grips at its end."""
    nodes: Float64[np.ndarray, "n 3"]
    """The shape at its end [m]."""


def corridor(problem: Problem, clearance: float) -> Corridor:
    """The shortest way in held shapes that keeps `clearance` [m] on it, start and goal excepted."""
    shapes = _held_shapes(problem)
    grid = _Grid.around(problem, shapes)
    free = np.stack([grid.free(problem, held, clearance) for held in shapes])
    start = (0, *grid.cell(_middle(problem.grips)))
    goal = (1, *grid.cell(_middle(problem.goal_grips)))
    free[start] = True
    # Start and goal may be nearer to things than the way.
    free[goal] = True
    order = _wave(free, start, goal)
    end = goal if order[goal] >= 0 else _nearest(problem, shapes, grid, order)
    cells = _shortened(_back(order, end), free)
    grips = np.stack([grid.point(cell) + shapes[cell[0]].grips for cell in cells])
    grips[0] = np.stack([g.position for g in problem.grips])
    if end == goal:
        grips[-1] = np.stack([g.position for g in problem.goal_grips])
        return Corridor(True, grips, problem.goal_grips, problem.goal)
    held = shapes[end[0]]
    left, right = (Pose(p, q) for p, q in zip(grips[-1], held.orientations, strict=True))
    return Corridor(False, grips, (left, right), grid.point(end) + held.nodes)


def displacements(grips: Float64[np.ndarray, "w 2 3"], blocks: int) -> Float64[np.ndarray, "k 2 3"]:
    """Way-points as displacements in blocks, each leg in as many as its length is worth [m]."""
    lengths = np.linalg.norm(np.diff(grips, axis=0), axis=2).max(axis=1)
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
    flat = grips.reshape(len(grips), 6)
    places = [np.interp(at, np.arange(legs + 1), column) for column in flat.T]
    return np.diff(np.stack(places, axis=1), axis=0).reshape(blocks, 2, 3)


@dataclass(frozen=True)
class _Grid:
    """Places for the middle of the grips, and the distance field around them."""

    origin: Float64[np.ndarray, "3"]
    """Of the first place [m]; the start lies on a place."""
    size: tuple[int, int, int]
    spacing: float
    """[m]"""
    pad: int
    """Cells by which the field is larger on every side."""
    field: Float64[np.ndarray, "x y z"]
    """Distance to the nearest obstacle [m]."""

    @classmethod
    def around(cls, problem: Problem, shapes: Sequence[Held]) -> _Grid:
        scale = max(problem.rod.properties.length / USUAL, 1.0)
        spacing = SPACING * scale
        ends = np.stack([_middle(problem.grips), _middle(problem.goal_grips)])
        low, high = ends.min(axis=0) - AROUND * scale, ends.max(axis=0) + AROUND * scale
        tops = [_top(o) for o in problem.solid if o.shape != "half_space"]
        sag = max(float(-s.nodes[:, 2].min()) for s in shapes[2:])
        ceiling = max([*tops, float(ends[:, 2].max())]) + sag + 0.05
        space = np.array(problem.limits.workspace)
        high[2] = min(max(high[2], ceiling), space[1][2])
        low, high = np.maximum(low, space[0]), np.minimum(high, space[1])
        before = np.ceil((ends[0] - low) / spacing)
        size = (before + np.ceil((high - ends[0]) / spacing)).astype(int) + 1
        reach = max(float(np.abs(np.vstack([s.nodes, s.bodies])).max()) for s in shapes)
        pad = int(np.ceil(reach / spacing)) + 2
        origin = ends[0] - before * spacing
        axes = [o + spacing * np.arange(-pad, n + pad) for o, n in zip(origin, size, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        field = np.full(points.shape[:-1], np.inf)
        for obstacle in problem.solid:
            field = np.minimum(field, signed_distance(points, obstacle))
        nx, ny, nz = size.tolist()
        return cls(origin, (nx, ny, nz), spacing, pad, field)

    def cell(self, place: Float64[np.ndarray, "3"]) -> tuple[int, int, int]:
        """The place nearest to a point."""
        index = np.round((place - self.origin) / self.spacing).astype(int)
        x, y, z = np.clip(index, 0, np.array(self.size) - 1).tolist()
        return x, y, z

    def point(self, cell: Cell) -> Float64[np.ndarray, "3"]:
        """Of a cell [m]."""
        return self.origin + self.spacing * np.array(cell[1:])

    def free(self, problem: Problem, held: Held, clearance: float) -> Bool[np.ndarray, "x y z"]:
        """Where the middle of the grips can be with a shape."""
        limits = problem.limits
        every = max(1, -(-len(held.nodes) // POINTS))
        body = max(clearance, limits.keep_out) + limits.gripper_radius
        parts = (
            (held.nodes[::every], clearance + problem.radius),
            (held.bodies, body),
        )
        found = np.ones(self.size, dtype=bool)
        for points, margin in parts:
            for point in points:
                found &= self._distances(point) > margin
        low, high = np.array(limits.workspace)
        for axis in range(3):
            at = self.origin[axis] + self.spacing * np.arange(self.size[axis])
            inside = np.ones(len(at), dtype=bool)
            for grip in held.grips:
                inside &= (at + grip[axis] >= low[axis]) & (at + grip[axis] <= high[axis])
            shape = [1, 1, 1]
            shape[axis] = -1
            found &= inside.reshape(shape)
        return found

    def _distances(self, offset: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "x y z"]:
        """Of all places moved by an offset, between the field's points."""
        steps = offset / self.spacing + self.pad
        first = np.floor(steps).astype(int)
        share = steps - first
        total = np.zeros(self.size)
        for corner in np.ndindex(2, 2, 2):
            weight = float(np.prod(np.where(corner, share, 1.0 - share)))
            if weight > 1e-9:
                slices = tuple(
                    slice(f + c, f + c + n)
                    for f, c, n in zip(first.tolist(), corner, self.size, strict=True)
                )
                total += weight * self.field[slices]
        return total


def _held_shapes(problem: Problem) -> list[Held]:
    """As it hangs now, as it shall hang, then stretched in several ways."""
    reach = problem.limits.gripper_reach
    shapes = [
        _held(problem.state.positions, problem.grips, reach),
        _held(problem.goal, problem.goal_grips, reach),
    ]
    now, goal = problem.grips, problem.goal_grips
    turned = [
        poses.multiply(
            poses.exponential(
                0.5 * poses.logarithm(poses.multiply(b.orientation, poses.conjugate(a.orientation)))
            ),
            a.orientation,
        )
        for a, b in zip(now, goal, strict=True)
    ]
    forward = np.array([0.0, 0.0, 1.0])
    pointing = sum(poses.rotate(q, forward) for q in turned)
    headings: list[float] = []
    for chord in (pointing, now[1].position - now[0].position, goal[1].position - goal[0].position):
        heading = float(np.arctan2(chord[1], chord[0]))
        if all(abs(np.angle(np.exp(1j * (heading - h)))) > ALIKE for h in headings):
            headings.append(heading)
    for heading in headings:
        chord = problem.rod.properties.length * np.array([np.cos(heading), np.sin(heading), 0.0])
        for taut in TAUT:
            left, right = Pose(-0.5 * taut * chord, turned[0]), Pose(0.5 * taut * chord, turned[1])
            try:
                rest = problem.rod.rest(left, right)
            except ValueError:
                continue
            if rest.converged:
                shapes.append(_held(rest.state.positions, (left, right), reach))
    return shapes


def _held(nodes: Float64[np.ndarray, "n 3"], grips: tuple[Pose, Pose], reach: float) -> Held:
    middle = _middle(grips)
    places = np.stack([g.position for g in grips])
    bodies = gripper_points(*grips, reach)
    turned = np.stack([g.orientation for g in grips])
    return Held(places - middle, turned, nodes - middle, bodies - middle)


def _middle(grips: tuple[Pose, Pose]) -> Float64[np.ndarray, "3"]:
    return 0.5 * (grips[0].position + grips[1].position)


def _top(obstacle: Obstacle) -> float:
    """A height that no part of the body exceeds [m]."""
    half = np.linalg.norm(obstacle.size) / 2.0 + obstacle.height / 2.0 + obstacle.radius
    if obstacle.shape == "box":
        up = poses.rotate(
            poses.conjugate(np.array(obstacle.orientation)), np.array([0.0, 0.0, 1.0])
        )
        half = float(np.abs(up) @ np.array(obstacle.size)) / 2.0
    return obstacle.position[2] + float(half)


def _wave(
    free: Bool[np.ndarray, "s x y z"], start: Cell, goal: Cell
) -> Int16[np.ndarray, "s x y z"]:
    """When each cell was reached first; -1 for never."""
    order = np.full(free.shape, -1, dtype=np.int16)
    front = np.zeros(free.shape, dtype=bool)
    front[start] = True
    order[start] = 0
    open_ = free.copy()
    open_[start] = False
    for step in range(1, 2000):
        near = np.broadcast_to(front.any(axis=0), front.shape).copy()
        for axis in (1, 2, 3):
            ahead = [slice(None)] * 4
            behind = [slice(None)] * 4
            ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
            near[tuple(ahead)] |= front[tuple(behind)]
            near[tuple(behind)] |= front[tuple(ahead)]
        front = near & open_
        if not front.any():
            break
        open_ &= ~front
        order[front] = step
        if front[goal]:
            break
    return order


def _back(order: Int16[np.ndarray, "s x y z"], end: Cell) -> list[Cell]:
    """Cells from the start to one that the wave reached; it keeps its direction where it can."""
    cells = [end]
    last = (0, 0, 0, 0)
    while order[cells[-1]] > 0:
        here = cells[-1]
        wanted = order[here] - 1
        moves = [last, *_MOVES]
        places = [tuple(a + b for a, b in zip(here, move, strict=True)) for move in moves]
        places += [(shape, *here[1:]) for shape in range(order.shape[0])]
        for place in places:
            inside = all(0 <= p < n for p, n in zip(place, order.shape, strict=True))
            if inside and order[place] == wanted:
                last = tuple(b - a for a, b in zip(here, place, strict=True))
                cells.append(place)
                break
    return cells[::-1]


_MOVES = [tuple(int(s) * int(k == axis) for k in range(4)) for axis in (1, 2, 3) for s in (-1, 1)]


def _shortened(cells: list[Cell], free: Bool[np.ndarray, "s x y z"]) -> list[Cell]:
    """The same way with straight legs where both ends' shapes are free along the leg."""
    kept = [cells[0]]
    at = 0
    while at < len(cells) - 1:
        ahead = next(
            k
            for k in range(len(cells) - 1, at, -1)
            if k == at + 1 or _sees(cells[at], cells[k], free)
        )
        kept.append(cells[ahead])
        at = ahead
    return [a for a, b in pairwise(kept) if a != b] + [kept[-1]]


def _sees(one: Cell, other: Cell, free: Bool[np.ndarray, "s x y z"]) -> bool:
    a, b = np.array(one[1:]), np.array(other[1:])
    count = 2 * int(np.max(np.abs(b - a))) + 1
    places = np.round(a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)).astype(int)
    inner = places[1:-1]
    x, y, z = inner.T
    return bool(np.all(free[one[0], x, y, z]) and np.all(free[other[0], x, y, z]))


def _nearest(
    problem: Problem,
    shapes: Sequence[Held],
    grid: _Grid,
    order: Int16[np.ndarray, "s x y z"],
) -> Cell:
    """The cell reached whose shape is nearest to the goal."""
    best, least = (0, *grid.cell(_middle(problem.grips))), np.inf
    axes = [grid.origin[k] + grid.spacing * np.arange(grid.size[k]) for k in range(3)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    for index, held in enumerate(shapes):
        reached = order[index] >= 0
        if not reached.any():
            continue
        offset = problem.goal - held.nodes
        # The root mean square over the nodes needs their mean offset alone.
        middle = offset.mean(axis=0)
        spread = float(np.mean(np.sum((offset - middle) ** 2, axis=1)))
        miss = np.sum((places - middle) ** 2, axis=-1) + spread
        miss = np.where(reached, miss, np.inf)
        flat = int(np.argmin(miss))
        if miss.flat[flat] < least:
            least = float(miss.flat[flat])
            x, y, z = np.unravel_index(flat, miss.shape)
            best = (index, int(x), int(y), int(z))
    return best
