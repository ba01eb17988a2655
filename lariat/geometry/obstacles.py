"""Convex obstacles and their signed distances.

Conventions: the distance is negative inside; normals point outwards. Cylinders and capsules extend
along the local z axis and are centred at their position; the `height` of a capsule is the distance
between the centres of its two caps; the `size` of a box holds its full extents; a half space is the
side of the plane through `position` from which `normal` (in the local frame) points away. A body
with `keep_in` stands for its outside: a region that the rope must not leave. All signs are turned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses

Shape = Literal["cylinder", "box", "sphere", "capsule", "half_space"]
SHAPES: tuple[Shape, ...] = get_args(Shape)
"""All shapes; the place of a shape is its index in packed obstacles."""

IDENTITY = (1.0, 0.0, 0.0, 0.0)
"""Orientation of a body that is not rotated."""
PACKED_WIDTH = 12
"""Number of columns of `pack`: shape index, position (3), orientation (4), sizes (3), support."""
SUPPORT_COLUMN = 11
"""Column of `pack` that is one for supports and zero for other obstacles."""


@dataclass(frozen=True)
class Obstacle:
    """Convex body."""

    shape: Shape
    """Kind of the body."""
    position: tuple[float, float, float]
    """Centre, or a point of the plane for a half space [m]."""
    orientation: tuple[float, float, float, float] = IDENTITY
    """Orientation, local to world, unit quaternion wxyz."""
    radius: float = 0.0
    """Radius of a cylinder, sphere or capsule [m]."""
    height: float = 0.0
    """Height of a cylinder; distance between the centres of a capsule's caps [m]."""
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Full extents of a box [m]."""
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Outward normal of a half space, in its local frame."""
    support: bool = False
    """Whether the rope may lean on it."""
    keep_in: bool = False
    """Whether the rope must stay inside the body, of which the outside is the obstacle. Only the
    rope keeps this rule; grippers and arms may be outside."""
    name: str = ""
    """Name, unique in a scene."""

    @cached_property
    def extents(self) -> tuple[float, float, float]:
        """Half extents along the world axes of a box around `position` that holds the body,
        infinite where none does [m]."""
        if self.keep_in or self.shape == "half_space":
            return (math.inf, math.inf, math.inf)
        a, b, c = poses.matrix(np.array(self.orientation)).tolist()
        return self._half_extent(*a), self._half_extent(*b), self._half_extent(*c)

    def _half_extent(self, x: float, y: float, z: float) -> float:
        """Half extent along a world axis, given in the local frame [m]."""
        if self.shape == "box":
            length, width, height = self.size
            return (abs(x) * length + abs(y) * width + abs(z) * height) / 2.0
        across = math.hypot(x, y) if self.shape == "cylinder" else 1.0
        return across * self.radius + abs(z) * self.height / 2.0

    def moved(
        self,
        position: tuple[float, float, float],
        orientation: tuple[float, float, float, float] | None = None,
    ) -> Obstacle:
        """Return the same body at another place."""
        return replace(self, position=position, orientation=orientation or self.orientation)


TABLE = Obstacle("half_space", (0.0, 0.0, 0.0), name="table")
"""Half space below the plane z = 0."""


def capsule_between(
    a: Float64[np.ndarray, "3"], b: Float64[np.ndarray, "3"], radius: float, name: str = ""
) -> Obstacle:
    """Return the capsule around a segment, a sphere where its ends coincide.

    Args:
        a: Centre of one cap [m].
        b: Centre of the other cap [m].
        radius: Radius [m].
        name: Name of the body.
    """
    height = float(np.linalg.norm(b - a))
    if height < 1e-9:
        return Obstacle("sphere", tuple(a.tolist()), radius=radius, name=name)
    turn = poses.rotation_between(np.array([0.0, 0.0, 1.0]), (b - a) / height)
    return Obstacle(
        "capsule",
        tuple((0.5 * (a + b)).tolist()),
        tuple(turn.tolist()),
        radius=radius,
        height=height,
        name=name,
    )


def signed_distance(
    points: Float64[np.ndarray, "*b 3"], obstacle: Obstacle
) -> Float64[np.ndarray, "*b"]:
    """Return the distance of points from the surface of an obstacle, negative inside [m].

    From a region to keep in, it is negative outside.
    """
    distance = _body_distance(points, obstacle)
    return -distance if obstacle.keep_in else distance


def _body_distance(
    points: Float64[np.ndarray, "*b 3"], obstacle: Obstacle
) -> Float64[np.ndarray, "*b"]:
    """Return the distance of points from the surface of a convex body, negative inside [m]."""
    local = np.asarray(points, float) - np.array(obstacle.position)
    if obstacle.orientation != IDENTITY:
        local = poses.rotate(poses.conjugate(np.array(obstacle.orientation)), local)
    match obstacle.shape:
        case "sphere":
            return np.linalg.norm(local, axis=-1) - obstacle.radius
        case "half_space":
            return local @ poses.normalized(np.array(obstacle.normal))
        case "capsule":
            half = obstacle.height / 2.0
            axis = np.zeros_like(local)
            axis[..., 2] = np.clip(local[..., 2], -half, half)
            return np.linalg.norm(local - axis, axis=-1) - obstacle.radius
        case "cylinder":
            radial = np.hypot(local[..., 0], local[..., 1]) - obstacle.radius
            axial = np.abs(local[..., 2]) - obstacle.height / 2.0
            beside, beyond = np.maximum(radial, 0.0), np.maximum(axial, 0.0)
            outside = np.sqrt(beside * beside + beyond * beyond)
            return outside + np.minimum(np.maximum(radial, axial), 0.0)
        case "box":
            excess = np.abs(local) - np.array(obstacle.size) / 2.0
    outside = np.linalg.norm(np.maximum(excess, 0.0), axis=-1)
    return outside + np.minimum(np.max(excess, axis=-1), 0.0)


def bounding_box(
    points: Float64[np.ndarray, "*b 3"],
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the least and the greatest corner of the box around points [m]."""
    columns = points.reshape(-1, 3).T.copy()
    (a, b, c), (x, y, z) = columns.min(axis=1).tolist(), columns.max(axis=1).tolist()
    return (a, b, c), (x, y, z)


def out_of_reach(
    box: tuple[tuple[float, float, float], tuple[float, float, float]],
    obstacle: Obstacle,
    reach: float,
) -> bool:
    """Return whether no point of a box can be as near to an obstacle as `reach` [m].

    Args:
        box: Corners as returned by `bounding_box` [m].
        obstacle: Obstacle.
        reach: Distance from the surface [m].
    """
    if obstacle.shape == "half_space" and obstacle.orientation == IDENTITY:
        if obstacle.keep_in:
            return False
        sides = zip(obstacle.normal, obstacle.position, *box, strict=True)
        height = sum(min(n * (low - x), n * (high - x)) for n, x, low, high in sides)
        return height > reach * math.hypot(*obstacle.normal)
    (a, b, c), (d, e, f) = box
    x, y, z = obstacle.position
    u, v, w = obstacle.extents
    gap = math.hypot(
        max(a - x - u, 0.0, x - u - d),
        max(b - y - v, 0.0, y - v - e),
        max(c - z - w, 0.0, z - w - f),
    )
    return gap > reach


def scene_distance(
    points: Float64[np.ndarray, "*b 3"], obstacles: Sequence[Obstacle]
) -> Float64[np.ndarray, "*b"]:
    """Return the distance of points from the nearest obstacle, infinite in an empty scene [m]."""
    points = np.asarray(points, float)
    nearest = np.full(points.shape[:-1], np.inf)
    for obstacle in obstacles:
        nearest = np.minimum(nearest, signed_distance(points, obstacle))
    return nearest


def segment_distance(
    starts: Float64[np.ndarray, "m 3"], ends: Float64[np.ndarray, "m 3"], obstacle: Obstacle
) -> Float64[np.ndarray, "m"]:
    """Return the distance of segments from an obstacle, to within 1e-5 of their length [m].

    The signed distance of a convex body is convex along a line: the smallest of a few samples and
    its two neighbours bracket the minimum. That of a region to keep in is concave, and least at
    one of the ends.

    Args:
        starts: First ends of the segments [m].
        ends: Other ends of the segments [m].
        obstacle: One obstacle.
    """
    if obstacle.keep_in:
        return np.minimum(signed_distance(starts, obstacle), signed_distance(ends, obstacle))
    directions = (ends - starts)[:, None]
    low, width = np.zeros((len(starts), 1)), 1.0
    fractions = np.linspace(0.0, 1.0, 9)
    least = np.full(len(starts), np.inf)
    for _ in range(8):
        at = low + width * fractions
        distances = signed_distance(starts[:, None] + at[..., None] * directions, obstacle)
        least = np.minimum(least, np.min(distances, axis=1))
        best = np.argmin(distances, axis=1)
        low = low + width * fractions[np.minimum(np.maximum(best - 1, 0), 6)][:, None]
        width /= 4.0
    return least


def chain_clearance(
    nodes: Float64[np.ndarray, "n 3"], radius: float, obstacles: Sequence[Obstacle]
) -> float:
    """Return the clearance between a rope and the nearest obstacle, negative on overlap [m].

    Args:
        nodes: Nodes of the rope's centreline [m].
        radius: Radius of the rope [m].
        obstacles: Obstacles of the scene.
    """
    lengths = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    nearest = np.inf
    for obstacle in obstacles:
        at_nodes = signed_distance(nodes, obstacle)
        nearest = min(nearest, float(np.min(at_nodes)))
        # A distance changes by at most the distance travelled, which rules out most segments.
        bound = 0.5 * (at_nodes[:-1] + at_nodes[1:] - lengths)
        (near,) = np.nonzero(bound < nearest)
        if len(near):
            between = segment_distance(nodes[near], nodes[near + 1], obstacle)
            nearest = min(nearest, float(np.min(between)))
    return nearest - radius


def pack_supports(obstacles: Sequence[Obstacle]) -> Float64[np.ndarray, "m 12"] | None:
    """Return the obstacles that the rope may lean on, packed for the rod; None without any.

    Args:
        obstacles: Obstacles, supports among them.
    """
    supports = [o for o in obstacles if o.support]
    return pack(supports) if supports else None


def pack(obstacles: Sequence[Obstacle]) -> Float64[np.ndarray, "m 12"]:
    """Return one row per obstacle for compiled kernels, columns as in `PACKED_WIDTH`.

    The three sizes are (radius, half height, 0) of cylinders, capsules and spheres, the half
    extents of a box and the unit normal of a half space.

    Raises:
        ValueError: An obstacle is a region to keep in, which the kernels do not know.
    """
    for o in obstacles:
        if o.keep_in:
            raise ValueError(f"{o.name!r} is a region to keep in, no body that a rod can touch")
    rows = np.zeros((len(obstacles), PACKED_WIDTH))
    for row, o in zip(rows, obstacles, strict=True):
        row[0] = SHAPES.index(o.shape)
        row[1:4], row[4:8] = o.position, o.orientation
        if o.shape == "box":
            row[8:11] = np.array(o.size) / 2.0
        elif o.shape == "half_space":
            row[8:11] = poses.normalized(np.array(o.normal))
        else:
            row[8:11] = o.radius, o.height / 2.0, 0.0
        row[SUPPORT_COLUMN] = o.support
    return rows
