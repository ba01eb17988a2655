"""Half space: the side of a plane from which `normal` points away."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Float64

from lariat.shapes.shape import Body, BodyShape, Distances, Mesh, Points, Sizes


class HalfSpace(BodyShape):
    """Half space below the plane through the origin; its sizes are its unit normal."""

    fields = ()

    def distance(self, sizes: Sizes, points: Points) -> Distances:
        return np.vecdot(points, sizes)

    def gradient(self, sizes: Sizes, points: Float64[np.ndarray, "p 3"]) -> Points:
        return np.broadcast_to(sizes, points.shape)

    def support(self, sizes: Sizes, directions: Points) -> Distances:
        del sizes
        return np.full(directions.shape[:-1], math.inf)

    def bounding_radius(self, sizes: Sizes) -> Distances:
        return np.full(sizes.shape[:-1], math.inf)

    def thickness(self, sizes: Sizes) -> Distances:
        return np.full(sizes.shape[:-1], math.inf)

    def shrunk(self, sizes: Sizes, depth: float) -> Sizes:
        raise ValueError("a half space has no part that is thinner")

    def filling(self, x: float, y: float, z: float) -> Sizes:
        raise ValueError("a half space fills no box")

    def pack(self, body: Body) -> tuple[float, float, float]:
        x, y, z = body.normal
        length = math.hypot(x, y, z)
        return x / length, y / length, z / length

    def unpack(self, sizes: Float64[np.ndarray, "3"]) -> dict[str, Any]:
        return {"normal": tuple(sizes.tolist())}

    def mesh(self, sizes: Sizes, sides: int = 28) -> Mesh:
        raise ValueError("a half space has no closed surface")
