"""Spheres that cover the collision bodies of a URDF: primitives and meshes.

A body is cut into slices across its longest axis, and each slice gets the sphere around its points.
The points of a surface lie so dense that what is between them is covered by a margin.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]  # its wheel lives beside site-packages
from jaxtyping import Float64, Int64

POINT_DISTANCE = 0.012
"""Largest distance of two neighbouring points of a surface [m]."""
MAX_SUBDIVISIONS = 6
"""Largest number of times that a triangle is divided."""
MAX_MESH_SIZE = 10.0
"""Largest extent of a mesh that is taken for metres [m]."""
CIRCLE_POINTS = 24
"""Points around the circle of a cylinder."""
SLICES_PER_WIDTH = 2.0
"""Slices along a body for each of its widths [-]."""

Cover = tuple[Float64[np.ndarray, "k 3"], Float64[np.ndarray, "k"]]
"""Centres and radii of k spheres in the frame of a body [m]."""


def sphere_cover(body: pinocchio.GeometryObject) -> Cover:
    """Return spheres that cover a collision body, in the frame of its joint.

    Args:
        body: Cylinder, box, sphere, capsule or mesh.

    Raises:
        ValueError: The body is of another kind.
    """
    rotation = np.array(body.placement.rotation)
    translation = np.array(body.placement.translation)
    centres, radii = _cover(_surface(body))
    return centres @ rotation.T + translation, radii


def _cover(points: Float64[np.ndarray, "p 3"]) -> Cover:
    """Spheres around the slices of a cloud of points."""
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    along = (points - middle) @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    length, width = high[0] - low[0], max(high[1] - low[1], high[2] - low[2])
    count = max(1, round(SLICES_PER_WIDTH * length / max(width, 1e-3)))
    edges = np.linspace(low[0], high[0], count + 1)
    centres, radii = [], []
    for begin, end in pairwise(edges):
        inside = (along[:, 0] >= begin - POINT_DISTANCE) & (along[:, 0] <= end + POINT_DISTANCE)
        slice_points = along[inside]
        if not len(slice_points):
            continue
        centre = 0.5 * (slice_points.min(axis=0) + slice_points.max(axis=0))
        centres.append(middle + centre @ axes)
        radii.append(np.max(np.linalg.norm(slice_points - centre, axis=1)))
    return np.array(centres), np.array(radii)


def _surface(body: pinocchio.GeometryObject) -> Float64[np.ndarray, "p 3"]:
    """Points on the surface of a body, in its own frame."""
    shape = body.geometry
    kind = type(shape).__name__
    if kind in ("Cylinder", "Capsule"):
        reach = shape.halfLength + (shape.radius if kind == "Capsule" else 0.0)
        return _tube(shape.radius, reach)
    if kind == "Sphere":
        return shape.radius * np.concatenate([np.eye(3), -np.eye(3)])
    if kind == "Box":
        corners = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
        return corners * np.array(shape.halfSide)
    if kind.startswith("BVHModel"):
        points = _mesh(shape) * np.array(body.meshScale)
        size = float(np.max(np.ptp(points, axis=0)))
        if size > MAX_MESH_SIZE:
            raise ValueError(
                f"mesh {body.meshPath} is {size:.4g} m large; one in millimetres takes "
                'scale="0.001 0.001 0.001" in the URDF'
            )
        return points
    raise ValueError(f"body {body.name!r} is a {kind}; use cylinders, boxes, spheres or meshes")


def _tube(radius: float, reach: float) -> Float64[np.ndarray, "p 3"]:
    angles = np.linspace(0.0, 2.0 * np.pi, CIRCLE_POINTS, endpoint=False)
    # The corners of the polygon lie outside of the circle, so that its sides touch it.
    outer = radius / np.cos(np.pi / CIRCLE_POINTS)
    circle = outer * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    heights = np.linspace(-reach, reach, 2 + int(2.0 * reach / POINT_DISTANCE))
    return np.array([[x, y, z] for z in heights for x, y in circle])


def _mesh(mesh: Any) -> Float64[np.ndarray, "p 3"]:
    """Vertices of a mesh, and of its triangles divided until their edges are short."""
    count = mesh.num_vertices
    vertices = np.array([mesh.vertex(k) for k in range(count)])
    triangles = np.array([[mesh.tri_indices(k)[i] for i in range(3)] for k in range(mesh.num_tris)])
    return _divided(vertices, triangles)


def _divided(
    vertices: Float64[np.ndarray, "v 3"], triangles: Int64[np.ndarray, "t 3"]
) -> Float64[np.ndarray, "p 3"]:
    corners = vertices[triangles]
    points = [vertices]
    for _ in range(MAX_SUBDIVISIONS):
        longest = np.max(
            np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1, initial=0.0
        )
        corners = corners[longest > POINT_DISTANCE]
        if not len(corners):
            break
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        points += [ab, bc, ca]
        corners = np.concatenate(
            [np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    return np.concatenate(points)
