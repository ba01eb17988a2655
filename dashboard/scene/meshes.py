"""Triangle meshes of round bodies, and the poses of the cylinders that form a tube.

Bodies of revolution stand along z and are centred at the origin, as obstacles do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import poses

Z_AXIS = np.array([0.0, 0.0, 1.0])
"""Axis of the bodies of revolution."""
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


def surface_of_revolution(*profiles: Float64[np.ndarray, "k 2"], sides: int = 40) -> Mesh:
    """Create a surface of revolution about z.

    Args:
        profiles: Chains of (radius, z) [m] from bottom to top. The surface is smooth along a
            chain and has a sharp edge where two chains meet.
        sides: Number of facets around the axis.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices, faces, count = [], [], 0
    j = np.arange(sides)
    for profile in profiles:
        radius, z = np.asarray(profile, float).T
        ring = np.empty((len(radius), sides, 3))
        ring[..., :2] = radius[:, None, None] * around
        ring[..., 2] = z[:, None]
        vertices.append(ring.reshape(-1, 3))
        for k in range(len(radius) - 1):
            low, high = count + k * sides, count + (k + 1) * sides
            following = (j + 1) % sides
            faces.append(np.stack([low + j, low + following, high + following], axis=1))
            faces.append(np.stack([low + j, high + following, high + j], axis=1))
        count += len(radius) * sides
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def cylinder(radius: float, height: float, sides: int = 40) -> Mesh:
    """Create a closed cylinder, `height` from cap to cap [m]."""
    h = height / 2.0
    return surface_of_revolution(
        np.array([[0.0, -h], [radius, -h]]),
        np.array([[radius, -h], [radius, h]]),
        np.array([[radius, h], [0.0, h]]),
        sides=sides,
    )


def capsule(radius: float, height: float, sides: int = 32) -> Mesh:
    """Create a capsule, `height` between the centres of its caps [m]; a sphere if that is 0."""
    rise = np.linspace(0.0, np.pi / 2.0, 9)
    cap = radius * np.stack([np.cos(rise), np.sin(rise)], axis=1)
    top = cap + np.array([0.0, height / 2.0])
    return surface_of_revolution(np.concatenate([top[::-1] * [1.0, -1.0], top]), sides=sides)


class Tube(NamedTuple):
    """Poses and scales of cylinders of radius 1 and height 1, one for each segment of a tube."""

    centres: Float64[np.ndarray, "n-1 3"]
    """Positions [m]."""
    orientations: Float64[np.ndarray, "n-1 4"]
    """Quaternions, wxyz."""
    scales: Float64[np.ndarray, "n-1 3"]
    """Radius, radius and length of each segment [m]."""


def tube(nodes: Float64[np.ndarray, "n 3"], radius: float) -> Tube:
    """Place one cylinder along each segment of a chain.

    Args:
        nodes: Node positions [m].
        radius: Radius of the tube [m].
    """
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
