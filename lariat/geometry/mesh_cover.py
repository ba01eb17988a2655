"""Cover of a triangle mesh by boxes, cylinders and spheres that contain its surface.

The mesh is cut by planes until its parts fill the bodies around them, or there are as many bodies
as are allowed. Every body contains the surface of its part. Where cuts cross within a thick
solid, a place inside may be in no body. Frames are matrices whose columns are axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.mesh_distance import MeshDistance
from lariat.geometry.obstacles import Obstacle

MIN_EXTENT = 5e-4
"""Least extent of a body along any of its axes [m]; a flat part gets this thickness."""
GROWTH = 2e-6
"""Length by which half of each extent is larger, so that rounded numbers cover the mesh [m]."""
DIGITS = 6
"""Decimals of the numbers of a body: computers that differ in the last bits agree on them."""
EVEN_CUTS = 3
"""Number of evenly spaced planes that are tried across each axis of a part."""
VERTEX_CUTS = 6
"""Largest number of planes through vertices that are tried across each axis of a part."""
FULLY_TRIED_CUTS = 3
"""Number of planes with the smallest boxes for which bodies are fitted and measured."""
TRIED_TRIANGLES = 400
"""Largest number of triangles by which the planes of a part are compared."""
MAX_COMPARED = 3_000_000
"""Cost of distances, as `MeshDistance.compared` counts it, for each body, after which the mesh is
not divided further; a lawful one of 40,000 triangles takes less than half of it."""
FACE_POINTS = 5
"""Points along an edge of a face at which the distance of a body from the mesh is measured."""

Triangles = Float64[np.ndarray, "m 3 3"]
Frame = Float64[np.ndarray, "3 3"]


@dataclass(frozen=True)
class MeshCover:
    """Bodies that contain a mesh."""

    bodies: tuple[Obstacle, ...]
    """Boxes, cylinders and spheres without names, in the frame of the mesh."""
    overreach: float
    """Largest distance of a body's surface from the mesh, outside of it [m]."""


@dataclass(frozen=True)
class _Part:
    """Part of the mesh with the body around it."""

    triangles: Triangles
    body: Obstacle
    frame: Frame
    overreach: float


def cover_mesh(triangles: Triangles, max_bodies: int, tolerance: float) -> MeshCover:
    """Return bodies that contain a mesh; the same for the same mesh.

    Args:
        triangles: Corners of the triangles; those of a closed mesh are ordered alike [m].
        max_bodies: Largest number of bodies.
        tolerance: Overreach below which a body is not divided further [m].

    Raises:
        ValueError: The mesh has no triangle with an area, or large ones that cross each other.
    """
    distance = MeshDistance(triangles)
    best = [_part(distance.triangles, np.eye(3), distance)]
    for cut in (_cut_in_the_middle, _cut_that_saves_most):
        parts = best[:1] if len(best) == 1 else [_part(distance.triangles, np.eye(3), distance)]
        while len(parts) < max_bodies and distance.compared < MAX_COMPARED * max_bodies:
            worst = max(parts, key=lambda part: part.overreach)
            halves = cut(worst, distance) if worst.overreach > tolerance else ()
            if not halves:
                break
            parts = [part for part in parts if part is not worst] + list(halves)
            best = min(best, parts, key=_overreach)
    return MeshCover(tuple(part.body for part in best), _overreach(best))


def _overreach(parts: Sequence[_Part]) -> float:
    return max(part.overreach for part in parts)


def _part(triangles: Triangles, frame: Frame, distance: MeshDistance) -> _Part:
    """Part with the body that sticks out of the mesh the least, of the smallest of each shape."""
    smallest: dict[str, tuple[float, Obstacle, Frame]] = {}
    frames = (np.eye(3), frame, _face_frame(triangles))
    for fit in fits(triangles.reshape(-1, 3), frames):
        shape = fit[1].shape
        if shape not in smallest or fit[0] < smallest[shape][0]:
            smallest[shape] = fit
    parts = []
    for _, body, axes in smallest.values():
        body = rounded(body)
        overreach = float(np.max(distance.outside(surface_points(body))))
        parts.append(_Part(triangles, body, axes, overreach))
    return min(parts, key=lambda part: part.overreach)


def _cut_in_the_middle(part: _Part, distance: MeshDistance) -> tuple[_Part, ...]:
    """Both sides of the plane through the middle of the longest extent; rings are cut so."""
    points = part.triangles.reshape(-1, 3)
    frame = principal_axes(points)
    along = points @ frame
    k = int(np.argmax(np.ptp(along, axis=0)))
    middle = 0.5 * float(along[:, k].min() + along[:, k].max())
    return _cut(part, distance, frame[:, k], middle)


def _cut_that_saves_most(part: _Part, distance: MeshDistance) -> tuple[_Part, ...]:
    """Both sides of the plane after which their bodies have the least volume."""
    tried = part.triangles[:: -(-len(part.triangles) // TRIED_TRIANGLES)]
    frames = (np.eye(3), part.frame, _face_frame(part.triangles))
    cuts: list[tuple[float, Float64[np.ndarray, "3"], float]] = []
    for axis in np.unique(np.concatenate([f.T for f in frames]).round(DIGITS), axis=0):
        for level in _levels(tried.reshape(-1, 3) @ axis):
            size = sum(_box_volume(half, frames) for half in split(tried, axis, level))
            cuts.append((size, axis, level))
    along = tried.reshape(-1, 3) @ part.frame
    middle = 0.5 * (along.min(axis=0) + along.max(axis=0))
    middles = [(0.0, part.frame[:, k], float(middle[k])) for k in range(3)]
    likely = sorted(cuts, key=lambda cut: cut[0])[:FULLY_TRIED_CUTS]
    halves = [_cut(part, distance, axis, level) for _, axis, level in likely + middles]
    return min(filter(None, halves), key=lambda h: sum(volume(p.body) for p in h), default=())


def _cut(
    part: _Part, distance: MeshDistance, axis: Float64[np.ndarray, "3"], level: float
) -> tuple[_Part, ...]:
    """Both sides of a plane; empty where it cuts nothing."""
    halves = split(part.triangles, axis, level)
    if not (len(halves[0]) and len(halves[1])):
        return ()
    return tuple(_part(half, part.frame, distance) for half in halves)


def _levels(along: Float64[np.ndarray, "p"]) -> Float64[np.ndarray, "c"]:
    """Places of the planes across an axis, strictly between both ends [m]."""
    low, high = float(along.min()), float(along.max())
    inner = np.unique(along.round(DIGITS))
    inner = inner[(inner > low + MIN_EXTENT) & (inner < high - MIN_EXTENT)]
    if len(inner) > VERTEX_CUTS:
        inner = inner[np.linspace(0, len(inner) - 1, VERTEX_CUTS).round().astype(int)]
    if high - low < 2.0 * MIN_EXTENT:
        return inner[:0]
    return np.concatenate([inner, np.linspace(low, high, EVEN_CUTS + 2)[1:-1]])


def split(
    triangles: Triangles, normal: Float64[np.ndarray, "3"], level: float
) -> tuple[Triangles, Triangles]:
    """Return the parts of triangles below and above the plane `normal · x = level`.

    Args:
        triangles: Corners of the triangles [m].
        normal: Unit normal of the plane.
        level: Distance of the plane from the origin along its normal [m].
    """
    height = triangles @ normal - level
    above = height > 0.0
    count = above.sum(axis=1)
    (crossed,) = np.nonzero((count == 1) | (count == 2))
    # Corners are rotated so that the one that is alone on its side comes first.
    alone = np.argmax(above[crossed] == (count[crossed] == 1)[:, None], axis=1)
    order = (alone[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(triangles[crossed], order[..., None], axis=1), 1, 0)
    ha, hb, hc = np.moveaxis(np.take_along_axis(height[crossed], order, axis=1), 1, 0)
    p = a + (ha / (ha - hb))[:, None] * (b - a)
    q = a + (ha / (ha - hc))[:, None] * (c - a)
    tip = np.stack([a, p, q], axis=1)
    rest = np.concatenate([np.stack([p, b, c], axis=1), np.stack([p, c, q], axis=1)])
    tip_above = count[crossed] == 1
    twice = np.concatenate([tip_above, tip_above])
    below = [triangles[count == 0], tip[~tip_above], rest[twice]]
    over = [triangles[count == 3], tip[tip_above], rest[~twice]]
    return np.concatenate(below), np.concatenate(over)


def volume(body: Obstacle) -> float:
    """Return the volume of a box, a cylinder or a sphere [m^3]."""
    match body.shape:
        case "box":
            return float(np.prod(body.size))
        case "cylinder":
            return float(np.pi * body.radius**2 * body.height)
        case _:
            return float(4.0 / 3.0 * np.pi * body.radius**3)


def _box_volume(triangles: Triangles, frames: Sequence[Frame]) -> float:
    """Volume of the least box around triangles in some frames or their principal one [m^3]."""
    points = triangles.reshape(-1, 3)
    if not len(points):
        return 0.0
    extents = [np.ptp(points @ axes, axis=0) for axes in (*frames, principal_axes(points))]
    return min(float(np.prod(np.maximum(size, MIN_EXTENT))) for size in extents)


def _face_frame(triangles: Triangles) -> Frame:
    """Frame of the largest triangle's normal and the next one that differs, right-handed."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    first = normals[np.argmax(areas)] / np.max(areas)
    across = normals - np.outer(normals @ first, first)
    sizes = np.linalg.norm(across, axis=1)
    # Rounding leaves something of parallel normals; the plate's own edge serves then.
    edge = triangles[np.argmax(areas), 1] - triangles[np.argmax(areas), 0]
    second = across[np.argmax(sizes)] if np.max(sizes) > 1e-6 * np.max(areas) else edge
    second = poses.normalized(second)
    return np.stack([first, second, np.cross(first, second)], axis=1)


def principal_axes(points: Float64[np.ndarray, "p 3"]) -> Frame:
    """Return the principal axes of points, right-handed."""
    centred = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    return axes * np.sign(np.linalg.det(axes))


def fits(
    points: Float64[np.ndarray, "p 3"], frames: Sequence[Frame]
) -> Iterator[tuple[float, Obstacle, Frame]]:
    """Yield bodies around points in some frames and their principal one, with volume [m^3]."""
    for axes in (*frames, principal_axes(points)):
        local = points @ axes
        low, high = local.min(axis=0), local.max(axis=0)
        size = np.maximum(high - low, MIN_EXTENT)
        middle = 0.5 * (low + high)
        centre = axes @ middle
        yield float(np.prod(size)), _body("box", centre, axes, size=size), axes
        for k in range(3):
            turned = np.roll(axes, 2 - k, axis=1)
            across = np.delete(local - middle, k, axis=1)
            radius = max(float(np.max(np.linalg.norm(across, axis=1))), 0.5 * MIN_EXTENT)
            body = _body("cylinder", centre, turned, radius=radius, height=float(size[k]))
            yield float(np.pi * radius**2 * size[k]), body, turned
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = max(float(np.max(np.linalg.norm(points - centre, axis=1))), 0.5 * MIN_EXTENT)
    yield (
        4.0 / 3.0 * np.pi * radius**3,
        _body("sphere", centre, np.eye(3), radius=radius),
        frames[0],
    )


def _body(shape, centre, axes, *, radius=0.0, height=0.0, size=(0.0, 0.0, 0.0)) -> Obstacle:
    turn = poses.from_matrix(axes)
    return Obstacle(shape, tuple(centre), tuple(turn), radius, height, tuple(size))


def rounded(body: Obstacle) -> Obstacle:
    """Return a body with rounded numbers, a little larger."""

    def larger(extent: float, share: float) -> float:
        return round(float(extent + share * GROWTH), DIGITS) if extent else 0.0

    turn = poses.normalized(np.array(body.orientation).round(DIGITS)).round(15)
    return replace(
        body,
        position=_numbers(body.position),
        orientation=tuple(float(x) for x in turn),
        radius=larger(body.radius, 1.0),
        height=larger(body.height, 2.0),
        size=tuple(larger(s, 2.0) for s in body.size),
    )


def _numbers(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (round(float(v), DIGITS) + 0.0 for v in values)
    return x, y, z


def surface_points(body: Obstacle) -> Float64[np.ndarray, "p 3"]:
    """Return points on the surface of a body [m]."""
    grid = np.linspace(-1.0, 1.0, FACE_POINTS)
    if body.shape == "box":
        u, v = (x.ravel() for x in np.meshgrid(grid, grid))
        faces = [np.insert(np.stack([u, v], 1), k, s, axis=1) for k in range(3) for s in (-1, 1)]
        local = np.concatenate(faces) * np.array(body.size) / 2.0
    else:
        angle = np.linspace(0.0, 2.0 * np.pi, 4 * FACE_POINTS, endpoint=False)
        around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        if body.shape == "sphere":
            rings = [(np.cos(t), np.sin(t)) for t in np.linspace(0.0, np.pi, 2 * FACE_POINTS)]
            scale = np.full(3, body.radius)
        else:
            rings = [(z, 1.0) for z in grid] + [(s, r) for s in (-1.0, 1.0) for r in (0.0, 0.5)]
            scale = np.array([body.radius, body.radius, body.height / 2.0])
        local = np.concatenate(
            [np.column_stack([r * around, np.full(len(around), z)]) for z, r in rings]
        )
        local = local * scale
    return poses.rotate(np.array(body.orientation), local) + np.array(body.position)
