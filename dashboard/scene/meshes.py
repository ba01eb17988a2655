"""Triangle meshes of round bodies and the poses that string them into a tube.

Bodies of revolution stand along z and are centred at the origin, as obstacles do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import poses

Z = np.array([0.0, 0.0, 1.0])


class Mesh(NamedTuple):
    """Triangles, seen from outside in counter-clockwise order."""

    vertices: Float64[np.ndarray, "v 3"]
    """[m]"""
    faces: Int64[np.ndarray, "f 3"]


def lathe(*profiles: Float64[np.ndarray, "k 2"], sides: int = 40) -> Mesh:
    """Surface of revolution about z.

    Args:
        profiles: Chains of (radius, z) [m] from bottom to top; where two chains meet there is a
            sharp edge, inside a chain the surface is smooth.
        sides: Facets around.
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
    """A closed cylinder, `height` from cap to cap [m]."""
    h = height / 2.0
    return lathe(
        np.array([[0.0, -h], [radius, -h]]),
        np.array([[radius, -h], [radius, h]]),
        np.array([[radius, h], [0.0, h]]),
        sides=sides,
    )


def capsule(radius: float, height: float, sides: int = 32) -> Mesh:
    """A capsule, `height` between the centres of its caps [m]; a sphere where that is 0."""
    rise = np.linspace(0.0, np.pi / 2.0, 9)
    cap = radius * np.stack([np.cos(rise), np.sin(rise)], axis=1)
    top = cap + np.array([0.0, height / 2.0])
    return lathe(np.concatenate([top[::-1] * [1.0, -1.0], top]), sides=sides)


class Tube(NamedTuple):
    """Poses of unit cylinders (radius 1, height 1) and unit spheres that together look like a
    tube."""

    centres: Float64[np.ndarray, "n-1 3"]
    orientations: Float64[np.ndarray, "n-1 4"]
    scales: Float64[np.ndarray, "n-1 3"]


def tube(nodes: Float64[np.ndarray, "n 3"], radius: float) -> Tube:
    """One cylinder for each segment of a chain [m]."""
    edges = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    # Two nodes at one place have no direction; any will do for a cylinder without height.
    directions = np.where(lengths[:, None] > 1e-9, edges / np.maximum(lengths, 1e-9)[:, None], Z)
    return Tube(
        (nodes[:-1] + nodes[1:]) / 2.0,
        poses.between(Z, directions),
        np.stack([np.full_like(lengths, radius), np.full_like(lengths, radius), lengths], axis=1),
    )
