"""What a shape of obstacles has to know: one class a shape, from which everything else is derived.

All points, directions and meshes are in the frame of the body; its centre is the origin.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections import defaultdict
from typing import Any, NamedTuple, Protocol

import numpy as np
from jaxtyping import Bool, Float64, Int64

DIFFERENCE = 1e-7
"""Half of the step of the differences by which a gradient is taken [m]."""
SMOOTH = 0.7
"""Cosine of the angle between two faces below which their edge is sharp [-]."""
BRACKETS = 12
"""Number of times that the part of a line with its nearest point is narrowed."""
NARROWING = 4
"""Factor by which it is narrowed each time, with twice as many samples."""

Points = Float64[np.ndarray, "*b 3"]
Distances = Float64[np.ndarray, "*b"]


Sizes = Float64[np.ndarray, "*b 3"]
"""Three numbers that state the sizes of one body, or of one a row [m]; each shape has its own."""


class Body(Protocol):
    """Fields of a body, of which a shape uses its own."""

    @property
    def radius(self) -> float:
        """Radius [m]."""
        ...

    @property
    def height(self) -> float:
        """Extent along z, or the distance between the centres of caps [m]."""
        ...

    @property
    def size(self) -> tuple[float, float, float]:
        """Extents along x, y and z [m]."""
        ...

    @property
    def normal(self) -> tuple[float, float, float]:
        """Outward normal of a half space."""
        ...


class Mesh(NamedTuple):
    """Surface of flat faces, whose corners run counter-clockwise when seen from outside."""

    points: Float64[np.ndarray, "p 3"]
    """Corners [m]."""
    faces: tuple[tuple[int, ...], ...]
    """Indices of the corners of each face."""

    @property
    def triangles(self) -> Int64[np.ndarray, "t 3"]:
        """Indices of the corners of triangles."""
        return np.array([(f[0], a, b) for f in self.faces for a, b in itertools.pairwise(f[1:])])

    def with_edges(self) -> Mesh:
        """Return the mesh with a corner for each side of a sharp edge, for smooth shading between.

        Renderers shade a corner by the mean normal of its faces.
        """
        points: list[Float64[np.ndarray, "3"]] = []
        normals: list[Float64[np.ndarray, "3"]] = []
        at_corner: dict[int, list[int]] = defaultdict(list)
        faces = []
        for face in self.faces:
            corners = self.points[list(face)]
            normal = unit(np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0))
            indices = []
            for k in face:
                same = (n for n in at_corner[k] if normals[n] @ normal > SMOOTH)
                index = next(same, len(points))
                if index == len(points):
                    points.append(self.points[k])
                    normals.append(normal)
                    at_corner[k].append(index)
                indices.append(index)
            faces.append(tuple(indices))
        return Mesh(np.array(points), tuple(faces))


class BodyShape(ABC):
    """Convex shape of a body."""

    fields: tuple[str, ...] = ("radius", "height")
    """Fields of a body that must be positive."""

    @abstractmethod
    def distance(self, sizes: Sizes, points: Points) -> Distances:
        """Return the signed distance of points from the surface, negative inside [m]."""

    @abstractmethod
    def support(self, sizes: Sizes, directions: Points) -> Distances:
        """Return how far the body extends from its centre along unit directions [m]."""

    @abstractmethod
    def bounding_radius(self, sizes: Sizes) -> Distances:
        """Return the radius of a sphere about the centre that contains the body [m]."""

    @abstractmethod
    def thickness(self, sizes: Sizes) -> Distances:
        """Return the least extent along any direction [m]."""

    @abstractmethod
    def shrunk(self, sizes: Sizes, depth: float) -> Sizes:
        """Return the sizes of a body inside this one, `depth` below its surface [m]."""

    @abstractmethod
    def filling(self, x: float, y: float, z: float) -> Sizes:
        """Return the sizes of the body that fills a box of these extents as well as it can [m]."""

    @abstractmethod
    def mesh(self, sizes: Sizes, sides: int = 28) -> Mesh:
        """Return the surface, round parts of so many sides."""

    def gradient(self, sizes: Sizes, points: Float64[np.ndarray, "p 3"]) -> Points:
        """Return the gradient of the distance: outward unit vectors.

        On edges, axes and centres, where it is not unique, it is one of the limits nearby.
        """
        steps = DIFFERENCE * np.eye(3)
        ahead, behind = (self.distance(sizes, points[:, None] + s * steps) for s in (1.0, -1.0))
        return unit(ahead - behind)

    def pack(self, body: Body) -> tuple[float, float, float]:
        """Return the sizes of a body: its radius, half of its height, zero."""
        return body.radius, body.height / 2.0, 0.0

    def unpack(self, sizes: Float64[np.ndarray, "3"]) -> dict[str, Any]:
        """Return the fields of a body with these sizes."""
        return {"radius": float(sizes[0]), "height": float(2.0 * sizes[1])}

    def cuts(
        self, sizes: Sizes, begins: Float64[np.ndarray, "m 3"], steps: Float64[np.ndarray, "m 3"]
    ) -> tuple[Bool[np.ndarray, "m"], Bool[np.ndarray, "m"]]:
        """Return which straight lines begin inside the body and which pass inside it.

        The distance from a convex body is convex along a line: the least of a few samples and its
        neighbours bracket the minimum.

        Args:
            begins: First ends of the lines [m].
            steps: Other ends less the first ones [m].
        """
        low, width = np.zeros(len(begins)), 1.0
        shares = np.linspace(0.0, 1.0, 2 * NARROWING + 1)
        least = np.full(len(begins), np.inf)
        for _ in range(BRACKETS):
            at = low[:, None] + width * shares
            points = begins[:, None] + at[..., None] * steps[:, None]
            distances = self.distance(sizes[..., None, :], points)
            least = np.minimum(least, distances.min(axis=1))
            best = np.clip(np.argmin(distances, axis=1) - 1, 0, len(shares) - 3)
            low = low + width * shares[best]
            width /= NARROWING
        return self.distance(sizes, begins) < 0.0, least < 0.0

    def faces(
        self, sizes: Sizes, points: Float64[np.ndarray, "m 3"]
    ) -> tuple[Float64[np.ndarray, "m k 3"], Float64[np.ndarray, "m k"]] | None:
        """Return axes across the flat and curved faces, and how far points lie beyond these [m].

        None where the body has no edges.
        """
        del sizes, points
        return None


def unit(vectors: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b 3"]:
    """Return vectors with length one; x where they have none."""
    sizes = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(sizes > 1e-12, vectors / np.maximum(sizes, 1e-12), np.array([1.0, 0.0, 0.0]))


def revolved(profile: Float64[np.ndarray, "k 2"], sides: int) -> Mesh:
    """Return the closed surface of revolution about z of a profile.

    Args:
        profile: Corners (radius, z) from bottom to top [m]; where the first or the last radius is
            not zero, a lid closes the surface.
        sides: Number of sides.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    points, rings, count = [], [], 0
    for radius, z in profile:
        flat = radius * (around if radius > 0.0 else around[:1])
        points.append(np.column_stack([flat, np.full(len(flat), z)]))
        rings.append([count + k % len(flat) for k in range(sides + 1)])
        count += len(flat)
    faces = [
        tuple(dict.fromkeys((low[k], low[k + 1], high[k + 1], high[k])))
        for low, high in itertools.pairwise(rings)
        for k in range(sides)
    ]
    if profile[0, 0] > 0.0:
        faces.append(tuple(rings[0][sides - 1 :: -1]))
    if profile[-1, 0] > 0.0:
        faces.append(tuple(rings[-1][:sides]))
    return Mesh(np.concatenate(points), tuple(faces))
