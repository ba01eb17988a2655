"""Triangle meshes of bodies, and the poses of the cylinders that form a tube."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import poses
from lariat.shapes import SHAPES, SolidName

Z_AXIS = np.array([0.0, 0.0, 1.0])
"""Axis of the cylinders."""
MIN_EDGE_LENGTH = 1e-9
"""Length below which an edge has no direction [m]."""
OPPOSITE = 1e-9
"""Sum of one and the cosine of an angle below which it is a half turn [-]."""


class Mesh(NamedTuple):
    """Triangles whose corners run counter-clockwise when seen from outside."""

    vertices: Float64[np.ndarray, "v 3"]
    """Positions [m]."""
    faces: Int64[np.ndarray, "f 3"]
    """Indices of each triangle's corners."""


def of_shape(shape: SolidName, *sizes: float, sides: int = 40) -> Mesh:
    """Return the surface of a shape, in its frame, of the sizes that the table of shapes packs."""
    packed = np.zeros(3)
    packed[: len(sizes)] = sizes
    mesh = SHAPES[shape].mesh(packed, sides).with_edges()
    return Mesh(mesh.points, mesh.triangles)


def tube_wall(sides: int) -> Mesh:
    """Return a cylinder of radius 1 and height 1 without lids."""
    mesh = SHAPES["cylinder"].mesh(np.array([1.0, 0.5, 0.0]), sides)
    return Mesh(mesh.points, mesh._replace(faces=mesh.faces[:sides]).triangles)


class Tube(NamedTuple):
    """Poses and scales of cylinders of radius 1 and height 1, one for each segment of a tube."""

    centres: Float64[np.ndarray, "n-1 3"]
    """Positions [m]."""
    orientations: Float64[np.ndarray, "n-1 4"]
    """Quaternions, wxyz."""
    scales: Float64[np.ndarray, "n-1 3"]
    """Radius, radius and length of each segment [m]."""


def tube(nodes: Float64[np.ndarray, "n 3"], radius: float) -> Tube:
    """Place one cylinder along each segment of a chain."""
    edges = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    # Coincident nodes have no direction; a cylinder without height may have any.
    directions = np.where(
        lengths[:, None] > MIN_EDGE_LENGTH,
        edges / np.maximum(lengths, MIN_EDGE_LENGTH)[:, None],
        Z_AXIS,
    )
    return Tube(
        (nodes[:-1] + nodes[1:]) / 2.0,
        _turned_from_z(directions),
        np.stack([np.full_like(lengths, radius), np.full_like(lengths, radius), lengths], axis=1),
    )


def _turned_from_z(directions: Float64[np.ndarray, "m 3"]) -> Float64[np.ndarray, "m 4"]:
    """Return the smallest rotations that turn the z axis into unit vectors.

    `poses.rotation_between` for one axis, at a fifth of its time: ropes are drawn at every step.
    """
    q = np.zeros((len(directions), 4))
    q[:, 0] = 1.0 + directions[:, 2]
    q[:, 1], q[:, 2] = -directions[:, 1], directions[:, 0]
    # Of the half turns that reverse the axis, the one about x.
    q[q[:, 0] < OPPOSITE] = (0.0, 1.0, 0.0, 0.0)
    return poses.normalized(q)
