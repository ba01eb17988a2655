"""Cylinder along z, `height` from lid to lid."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from lariat.shapes.box import within
from lariat.shapes.shape import BodyShape, Distances, Mesh, Points, Sizes, revolved, unit


class Cylinder(BodyShape):
    """Cylinder along z."""

    def distance(self, sizes: Sizes, points: Points) -> Distances:
        radial = np.hypot(points[..., 0], points[..., 1]) - sizes[..., 0]
        axial = np.abs(points[..., 2]) - sizes[..., 1]
        beside, beyond = np.maximum(radial, 0.0), np.maximum(axial, 0.0)
        outside = np.sqrt(beside * beside + beyond * beyond)
        return outside + np.minimum(np.maximum(radial, axial), 0.0)

    def gradient(self, sizes: Sizes, points: Float64[np.ndarray, "p 3"]) -> Points:
        across = unit(points * np.array([1.0, 1.0, 0.0]))
        along = np.zeros_like(points)
        along[:, 2] = np.where(points[:, 2] < 0.0, -1.0, 1.0)
        radial = np.hypot(points[:, 0], points[:, 1]) - sizes[..., 0]
        axial = np.abs(points[:, 2]) - sizes[..., 1]
        corner = np.maximum(radial, 0.0)[:, None] * across
        corner = unit(corner + np.maximum(axial, 0.0)[:, None] * along)
        face = np.where((radial > axial)[:, None], across, along)
        return np.where(((radial > 0.0) & (axial > 0.0))[:, None], corner, face)

    def support(self, sizes: Sizes, directions: Points) -> Distances:
        across = np.hypot(directions[..., 0], directions[..., 1])
        return across * sizes[..., 0] + np.abs(directions[..., 2]) * sizes[..., 1]

    def bounding_radius(self, sizes: Sizes) -> Distances:
        return np.hypot(sizes[..., 0], sizes[..., 1])

    def thickness(self, sizes: Sizes) -> Distances:
        return 2.0 * np.minimum(sizes[..., 0], sizes[..., 1])

    def shrunk(self, sizes: Sizes, depth: float) -> Sizes:
        return np.maximum(sizes - depth, 0.0)

    def filling(self, x: float, y: float, z: float) -> Sizes:
        del y
        return np.array([x / 2.0, z / 2.0, 0.0])

    def mesh(self, sizes: Sizes, sides: int = 28) -> Mesh:
        r, half, _ = sizes
        return revolved(np.array([[r, -half], [r, half]]), sides)

    def cuts(
        self, sizes: Sizes, begins: Float64[np.ndarray, "m 3"], steps: Float64[np.ndarray, "m 3"]
    ) -> tuple[Bool[np.ndarray, "m"], Bool[np.ndarray, "m"]]:
        low, high = within(begins[:, 2:], steps[:, 2:], sizes[..., 1:2])
        a = np.maximum(np.sum(steps[:, :2] ** 2, axis=1), 1e-18)
        b = np.sum(steps[:, :2] * begins[:, :2], axis=1)
        c = np.sum(begins[:, :2] ** 2, axis=1) - sizes[..., 0] ** 2
        root = b * b - a * c
        half = np.sqrt(np.maximum(root, 0.0))
        enters = np.maximum((-b - half) / a, low[:, 0])
        leaves = np.minimum((-b + half) / a, high[:, 0])
        inside = (c < 0.0) & (np.abs(begins[:, 2]) < sizes[..., 1])
        return inside, enters < leaves

    def faces(
        self, sizes: Sizes, points: Float64[np.ndarray, "m 3"]
    ) -> tuple[Float64[np.ndarray, "m k 3"], Float64[np.ndarray, "m k"]]:
        radial = points * np.array([1.0, 1.0, 0.0])
        radii = np.linalg.norm(radial, axis=1)
        radial /= np.maximum(radii, 1e-12)[:, None]
        axes = np.stack([radial, np.broadcast_to([0.0, 0.0, 1.0], radial.shape)], axis=1)
        beyond = np.stack([radii - sizes[..., 0], np.abs(points[:, 2]) - sizes[..., 1]], axis=1)
        return axes, beyond
