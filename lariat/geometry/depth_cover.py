"""Cover of what a depth image shows, by boxes, cylinders and spheres that contain all of it.

The columns of `lariat.geometry.depth_solid` are divided, by place in the image or by depth, until
the bodies around them fill no more than the tolerance of the space that is seen to be empty, or
there are as many bodies as are allowed. A convex body that contains the corners of a column
contains the column, and so the surface.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses
from lariat.geometry.depth_solid import Columns, DepthSolid
from lariat.geometry.mesh_cover import MIN_EXTENT, fits, principal_axes, rounded, surface_points
from lariat.geometry.obstacles import Obstacle

CUTS = 7
"""Number of places that are tried along each direction in which columns are divided."""


TRIED_CUTS = 4
"""Number of cuts with the smallest boxes whose bodies are measured."""


@dataclass(frozen=True)
class DepthCover:
    """Bodies that contain what a depth image shows."""

    bodies: tuple[Obstacle, ...]
    """Boxes, cylinders and spheres without names, in the world."""
    overreach: float
    """Largest distance by which a body sticks out into the space that is seen to be empty [m], at
    points of its surface."""


@dataclass(frozen=True)
class _Part:
    """Some columns with the body around them."""

    columns: Columns
    body: Obstacle
    overreach: float


def cover_depth(solid: DepthSolid, max_bodies: int, tolerance: float) -> DepthCover:
    """Return bodies that contain the solid behind a depth image; the same for the same image.

    Args:
        solid: Solid behind the visible surface.
        max_bodies: Largest number of bodies.
        tolerance: Overreach below which a body is not divided further [m].
    """
    parts, done = [_part(solid.columns(), solid)], []
    while parts and len(parts) + len(done) < max_bodies:
        worst = max(parts, key=lambda part: part.overreach)
        if worst.overreach <= tolerance:
            break
        parts = [part for part in parts if part is not worst]
        halves = _divided(worst.columns, solid)
        if not halves:
            done.append(worst)
        parts += halves
    parts += done
    return DepthCover(tuple(p.body for p in parts), max(p.overreach for p in parts))


def _part(columns: Columns, solid: DepthSolid) -> _Part:
    """Columns with the smallest body of the shape that sticks out the least."""
    smallest: dict[str, tuple[float, Obstacle]] = {}
    frames = (np.eye(3), _upright(columns), _along_rays(columns))
    for volume, body, _ in fits(columns.corners.reshape(-1, 3), frames):
        if body.shape not in smallest or volume < smallest[body.shape][0]:
            smallest[body.shape] = volume, body
    parts = []
    for _, body in smallest.values():
        body = rounded(body)
        reach = float(np.max(solid.outside(surface_points(body))))
        parts.append(_Part(columns, body, reach))
    return min(parts, key=lambda part: part.overreach)


def _upright(columns: Columns) -> Float64[np.ndarray, "3 3"]:
    """Frame with a vertical axis, turned to the principal axes of the fronts from above."""
    level = columns.corners[:, :4, :2].reshape(-1, 2)
    centred = level - level.mean(axis=0)
    (_, x), (_, y) = np.linalg.eigh(centred.T @ centred)[1]
    return np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]])


def _along_rays(columns: Columns) -> Float64[np.ndarray, "3 3"]:
    """Frame whose first axis is the mean direction of the columns, and whose second is level."""
    ray = poses.normalized(np.sum(columns.corners[:, 4:] - columns.corners[:, :4], axis=(0, 1)))
    level = np.cross([0.0, 0.0, 1.0], ray)
    level = poses.normalized(level if np.linalg.norm(level) > 1e-6 else np.array([1.0, 0.0, 0.0]))
    return np.stack([ray, level, np.cross(ray, level)], axis=1)


def _divided(columns: Columns, solid: DepthSolid) -> list[_Part]:
    """Both sides of the cut after which they stick out the least, of those with small boxes."""
    cuts = list(_cuts(columns))
    sizes = [_box_volume(columns, c) + _box_volume(columns, ~c) for c in cuts]
    tried = [cuts[k] for k in np.argsort(sizes, kind="stable")[:TRIED_CUTS]]
    pairs = [[_part(_selected(columns, side), solid) for side in (c, ~c)] for c in tried]
    return min(pairs, key=lambda pair: max(part.overreach for part in pair), default=[])


def _cuts(columns: Columns) -> Iterator[Bool[np.ndarray, "t"]]:
    """Yield the columns on one side of each cut that is tried."""
    heights = columns.corners[:, :4, 2].mean(axis=1)
    for values in (*columns.places.T, columns.depths, heights):
        ordered = np.sort(values)
        gaps = np.diff(ordered)
        levels = np.linspace(ordered[0], ordered[-1], CUTS + 2)[1:-1]
        if len(gaps):
            # Between things at different depths there is a gap.
            k = int(np.argmax(gaps))
            levels = np.append(levels, 0.5 * (ordered[k] + ordered[k + 1]))
        for level in levels:
            chosen = values <= level
            if np.any(chosen) and not np.all(chosen):
                yield chosen


def _selected(columns: Columns, chosen: Bool[np.ndarray, "t"]) -> Columns:
    return Columns(columns.corners[chosen], columns.places[chosen], columns.depths[chosen])


def _box_volume(columns: Columns, chosen: Bool[np.ndarray, "t"]) -> float:
    """Volume of the least box around some columns, upright or along their principal axes [m^3]."""
    some = _selected(columns, chosen)
    points = some.corners.reshape(-1, 3)
    extents = (np.ptp(points @ axes, axis=0) for axes in (_upright(some), principal_axes(points)))
    return min(float(np.prod(np.maximum(size, MIN_EXTENT))) for size in extents)
