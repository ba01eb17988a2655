"""Convex obstacles and their signed distances.

Conventions: the distance is negative inside; normals point outwards. Cylinders and capsules extend
along the local z axis and are centred at their position; the `height` of a capsule is the distance
between the centres of its two caps; the `size` of a box holds its full extents; a half space is the
side of the plane through `position` from which `normal` (in the local frame) points away; a cone
stands on its base, which is half of its height below `position`. A body
with `keep_in` stands for its outside: a region that the rope must not leave. All signs are turned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.shapes import SHAPES, BodyShape, ShapeCode, ShapeName

IDENTITY = (1.0, 0.0, 0.0, 0.0)
"""Orientation of a body that is not rotated."""
PACKED_WIDTH = 13
"""Number of columns of `pack`: shape index, position (3), orientation (4), sizes (3), support,
friction."""
SUPPORT_COLUMN = 11
"""Column of `pack` that is one for supports and zero for other obstacles."""
FRICTION_COLUMN = 12
"""Column of `pack` with the coefficient of friction [-]."""


@dataclass(frozen=True)
class Obstacle:
    """Convex body."""

    shape: ShapeName
    """Kind of the body."""
    position: tuple[float, float, float]
    """Centre, or a point of the plane for a half space [m]."""
    orientation: tuple[float, float, float, float] = IDENTITY
    """Orientation, local to world, unit quaternion wxyz."""
    radius: float = 0.0
    """Radius of a cylinder, sphere or capsule, and of a cone at its base [m]."""
    height: float = 0.0
    """Height of a cylinder or cone; distance between the centres of a capsule's caps [m]."""
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Full extents of a box [m]."""
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Outward normal of a half space, in its local frame."""
    support: bool = False
    """Whether the rope may lean on it."""
    friction: float = 0.0
    """Coefficient of friction that the rod (`lariat.rod.Rod`) has on it [-]."""
    keep_in: bool = False
    """Whether the rope must stay inside the body, of which the outside is the obstacle. Only the
    rope keeps this rule; grippers and arms may be outside."""
    name: str = ""
    """Name, unique in a scene."""

    @property
    def row(self) -> BodyShape:
        """Row of the table of shapes."""
        return SHAPES[self.shape]

    @cached_property
    def packed_sizes(self) -> Float64[np.ndarray, "3"]:
        """Sizes as the table of shapes takes them [m]."""
        return np.array(self.row.pack(self))

    @cached_property
    def extents(self) -> tuple[float, float, float]:
        """Half extents along the world axes of a box around `position` that holds the body,
        infinite where none does [m]."""
        if self.keep_in:
            return (math.inf, math.inf, math.inf)
        x, y, z = np.maximum(self.support_along(np.eye(3)), self.support_along(-np.eye(3)))
        return float(x), float(y), float(z)

    def support_along(self, directions: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b"]:
        """Return how far the body extends from `position` along directions of the world [m]."""
        turned = poses.rotate(poses.conjugate(np.array(self.orientation)), directions)
        return self.row.support(self.packed_sizes, turned)

    @cached_property
    def top(self) -> float:
        """Height of the highest point above `position` [m]."""
        return float(self.support_along(np.array([0.0, 0.0, 1.0])))

    @property
    def bounding_radius(self) -> float:
        """Radius of the sphere about `position` that contains the body [m]."""
        return float(self.row.bounding_radius(self.packed_sizes))

    @property
    def thickness(self) -> float:
        """Least extent along any direction, infinite for a region to keep in [m]."""
        return math.inf if self.keep_in else float(self.row.thickness(self.packed_sizes))

    def with_sizes(self, packed: Float64[np.ndarray, "3"]) -> Obstacle:
        """Return the same body with other sizes, as the table of shapes gives them [m]."""
        return replace(self, **self.row.unpack(packed))

    def local(self, points: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b 3"]:
        """Return points of the world in the frame of the body [m]."""
        local = np.asarray(points, float) - np.array(self.position)
        if self.orientation != IDENTITY:
            local = poses.rotate(poses.conjugate(np.array(self.orientation)), local)
        return local

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
    distance = obstacle.row.distance(obstacle.packed_sizes, obstacle.local(points))
    return -distance if obstacle.keep_in else distance


def outward_normals(
    points: Float64[np.ndarray, "p 3"], obstacle: Obstacle
) -> Float64[np.ndarray, "p 3"]:
    """Return the gradient of `signed_distance` at points: unit vectors away from the obstacle.

    Those of a region to keep in point into it.

    On edges, axes and centres, where the gradient is not unique, it is one of the limits nearby.

    Args:
        points: Points in the world frame [m].
        obstacle: One obstacle.
    """
    gradient = obstacle.row.gradient(obstacle.packed_sizes, obstacle.local(points))
    return poses.rotate(np.array(obstacle.orientation), -gradient if obstacle.keep_in else gradient)


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
    at_nodes = [signed_distance(nodes, obstacle) for obstacle in obstacles]
    nearest = min((float(np.min(distances)) for distances in at_nodes), default=np.inf)
    for obstacle, distances in zip(obstacles, at_nodes, strict=True):
        # A distance changes by at most the distance travelled, which rules out most segments.
        bound = 0.5 * (distances[:-1] + distances[1:] - lengths)
        (near,) = np.nonzero(bound < nearest)
        if len(near):
            between = segment_distance(nodes[near], nodes[near + 1], obstacle)
            nearest = min(nearest, float(np.min(between)))
    return nearest - radius


def has_friction(packed: Float64[np.ndarray, "m 13"] | None) -> bool:
    """Return whether any of packed obstacles has friction."""
    return packed is not None and bool(np.any(packed[:, FRICTION_COLUMN]))


def pack_supports(obstacles: Sequence[Obstacle]) -> Float64[np.ndarray, "m 13"] | None:
    """Return the obstacles that the rope may lean on, packed for the rod; None without any.

    Args:
        obstacles: Obstacles, supports among them.
    """
    supports = [o for o in obstacles if o.support]
    return pack(supports) if supports else None


def pack(obstacles: Sequence[Obstacle]) -> Float64[np.ndarray, "m 13"]:
    """Return one row per obstacle for compiled kernels, columns as in `PACKED_WIDTH`.

    The three sizes are those of the table of shapes: half extents, or radius and half height, or a
    normal.

    Raises:
        ValueError: An obstacle is a region to keep in, which the kernels do not know, or a friction
            is negative or not finite.
    """
    for o in obstacles:
        if not (o.friction >= 0.0 and math.isfinite(o.friction)):
            raise ValueError(
                f"friction of {o.name or o.shape!r} must be zero or more, got {o.friction}; try 0.3"
            )
        if o.keep_in:
            raise ValueError(f"{o.name!r} is a region to keep in, no body that a rod can touch")
    rows = np.zeros((len(obstacles), PACKED_WIDTH))
    for row, o in zip(rows, obstacles, strict=True):
        row[0] = ShapeCode[o.shape.upper()]
        row[1:4], row[4:8], row[8:11] = o.position, o.orientation, o.packed_sizes
        row[SUPPORT_COLUMN], row[FRICTION_COLUMN] = o.support, o.friction
    return rows
