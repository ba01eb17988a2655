"""Cone along z, `radius` at its base below, with its apex `height` above it."""

from __future__ import annotations

import numpy as np

from lariat.shapes.shape import BodyShape, Distances, Mesh, Points, Sizes, revolved


class Cone(BodyShape):
    """Cone along z, centred between base and apex."""

    def distance(self, sizes: Sizes, points: Points) -> Distances:
        radius, half = sizes[..., 0], sizes[..., 1]
        rho, z = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
        slant = np.hypot(radius, 2.0 * half)
        beyond = (2.0 * half * rho + radius * (z - half)) / slant
        below = -half - z
        inside = np.maximum(beyond, below)
        # Nearest points of the base and of the slanted side from the rim up to the apex.
        share = np.clip(((radius - rho) * radius + (z + half) * 2.0 * half) / slant**2, 0.0, 1.0)
        side = np.hypot(rho - (1.0 - share) * radius, z + half - 2.0 * half * share)
        base = np.hypot(np.maximum(rho - radius, 0.0), below)
        return np.where(inside > 0.0, np.minimum(side, base), inside)

    def support(self, sizes: Sizes, directions: Points) -> Distances:
        across, along = np.hypot(directions[..., 0], directions[..., 1]), directions[..., 2]
        half = sizes[..., 1]
        return np.maximum(across * sizes[..., 0] - along * half, along * half)

    def bounding_radius(self, sizes: Sizes) -> Distances:
        return np.hypot(sizes[..., 0], sizes[..., 1])

    def thickness(self, sizes: Sizes) -> Distances:
        # Of the largest ball inside.
        radius, height = sizes[..., 0], 2.0 * sizes[..., 1]
        return 2.0 * radius * height / (radius + np.hypot(radius, height))

    def shrunk(self, sizes: Sizes, depth: float) -> Sizes:
        # Of the same slope and centre: nowhere deeper than at the base.
        return sizes * max(1.0 - depth / float(sizes[1]), 0.0)

    def filling(self, x: float, y: float, z: float) -> Sizes:
        del y
        return np.array([x / 2.0, z / 2.0, 0.0])

    def mesh(self, sizes: Sizes, sides: int = 28) -> Mesh:
        radius, half, _ = sizes
        return revolved(np.array([[radius, -half], [0.0, half]]), sides)
