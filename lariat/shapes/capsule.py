"""Capsule along z, `height` between the centres of its caps; a sphere has none."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Bool, Float64

from lariat.shapes.shape import Body, BodyShape, Distances, Mesh, Points, Sizes, revolved, unit

RINGS = 10
"""Number of rings of a mesh from pole to pole, an even number."""
MIN_HEIGHT = 1e-3
"""Least height of a capsule that fills a box [m]."""


class Capsule(BodyShape):
    """Capsule along z."""

    def distance(self, sizes: Sizes, points: Points) -> Distances:
        return np.linalg.norm(self._off_axis(sizes, points), axis=-1) - sizes[..., 0]

    def gradient(self, sizes: Sizes, points: Float64[np.ndarray, "p 3"]) -> Points:
        return unit(self._off_axis(sizes, points))

    def _off_axis(self, sizes: Sizes, points: Points) -> Points:
        half = sizes[..., 1]
        axis = np.zeros_like(points)
        axis[..., 2] = np.clip(points[..., 2], -half, half)
        return points - axis

    def support(self, sizes: Sizes, directions: Points) -> Distances:
        return sizes[..., 0] + np.abs(directions[..., 2]) * sizes[..., 1]

    def bounding_radius(self, sizes: Sizes) -> Distances:
        return sizes[..., 0] + sizes[..., 1]

    def thickness(self, sizes: Sizes) -> Distances:
        return 2.0 * sizes[..., 0]

    def shrunk(self, sizes: Sizes, depth: float) -> Sizes:
        return np.stack([np.maximum(sizes[..., 0] - depth, 0.0), *sizes[..., 1:]])

    def filling(self, x: float, y: float, z: float) -> Sizes:
        del y
        return np.array([x / 2.0, max(z - x, MIN_HEIGHT) / 2.0, 0.0])

    def mesh(self, sizes: Sizes, sides: int = 28) -> Mesh:
        latitudes = np.linspace(-np.pi / 2.0, np.pi / 2.0, RINGS)
        half = np.where(latitudes < 0.0, -1.0, 1.0) * sizes[1]
        radii = sizes[0] * np.cos(latitudes)
        radii[[0, -1]] = 0.0
        return revolved(np.column_stack([radii, sizes[0] * np.sin(latitudes) + half]), sides)

    def cuts(
        self, sizes: Sizes, begins: Float64[np.ndarray, "m 3"], steps: Float64[np.ndarray, "m 3"]
    ) -> tuple[Bool[np.ndarray, "m"], Bool[np.ndarray, "m"]]:
        half, radius = sizes[..., 1], sizes[..., 0]
        inside = self.distance(sizes, begins) < 0.0
        # Closest points of two segments (Ericson, Real-Time Collision Detection, 2005, 5.1.9).
        flat = np.maximum(np.sum(steps[:, :2] ** 2, axis=1), 1e-18)
        share = np.clip(-np.sum(begins[:, :2] * steps[:, :2], axis=1) / flat, 0.0, 1.0)
        along = np.clip(begins[:, 2] + share * steps[:, 2], -half, half)
        lengths = np.maximum(np.sum(steps**2, axis=1), 1e-18)
        begins = begins - along[:, None] * np.array([0.0, 0.0, 1.0])
        share = np.clip(-np.sum(begins * steps, axis=1) / lengths, 0.0, 1.0)
        at = begins + share[:, None] * steps
        beyond = at[:, 2] + along - np.clip(at[:, 2] + along, -half, half)
        nearest = at[:, 0] ** 2 + at[:, 1] ** 2 + beyond**2
        return inside, nearest < radius**2


class Sphere(Capsule):
    """Sphere."""

    fields = ("radius",)

    def filling(self, x: float, y: float, z: float) -> Sizes:
        del y, z
        return np.array([x / 2.0, 0.0, 0.0])

    def pack(self, body: Body) -> tuple[float, float, float]:
        return body.radius, 0.0, 0.0

    def unpack(self, sizes: Float64[np.ndarray, "3"]) -> dict[str, Any]:
        return {"radius": float(sizes[0])}
