"""Distance of points from a triangle mesh."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, Int64

SAMPLES = 1200
"""Number of points on the surface that tell which triangles may be the nearest."""
CANDIDATES = 12
"""Number of nearest samples of a point whose triangles are measured exactly."""
FEW_TRIANGLES = 200
"""Number of triangles up to which all of them are measured."""
SAME_DISTANCE = 1e-9
"""Difference of two distances below which both triangles are the nearest [m]."""
MERGED_DIGITS = 7
"""Decimals of the coordinates by which corners of triangles are one vertex."""


class MeshDistance:
    """Distance from a mesh: exact to the nearest of the triangles around the nearest samples."""

    def __init__(self, triangles: Float64[np.ndarray, "m 3 3"]) -> None:
        """Prepare a mesh.

        Args:
            triangles: Corners of the triangles [m].

        Raises:
            ValueError: No triangle has an area.
        """
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        areas = np.linalg.norm(normals, axis=1)
        kept = areas > 1e-15
        if not np.any(kept):
            raise ValueError("the mesh has no triangle with an area")
        self.triangles, areas = triangles[kept], areas[kept]
        self._normals = normals[kept] / areas[:, None]
        self._closed = is_closed(self.triangles)
        if self._closed and np.sum(np.linalg.det(self.triangles)) < 0.0:
            self._normals = -self._normals
        self._samples, self._of = _samples(self.triangles, areas)

    def outside(self, points: Float64[np.ndarray, "p 3"]) -> Float64[np.ndarray, "p"]:
        """Return the distance of points from the mesh [m]; zero inside a closed one.

        Args:
            points: Points in the frame of the mesh [m].
        """
        which = self._candidates(points)
        nearest = nearest_points(points[:, None], self.triangles[which])
        away = points[:, None] - nearest
        distance = np.linalg.norm(away, axis=2)
        least = distance.min(axis=1)
        if not self._closed:
            return least
        side = np.einsum("pck,pck->pc", away, self._normals[which])
        beyond = (side > 0.0) & (distance <= least[:, None] + SAME_DISTANCE)
        return np.where(beyond.any(axis=1), least, 0.0)

    def _candidates(self, points: Float64[np.ndarray, "p 3"]) -> Int64[np.ndarray, "p c"]:
        """Triangles that may be the nearest to each point."""
        if len(self.triangles) <= FEW_TRIANGLES:
            return np.tile(np.arange(len(self.triangles)), (len(points), 1))
        # Squared distances less those of the points from the origin, which are the same in a row.
        square = np.sum(self._samples**2, axis=1) - 2.0 * points @ self._samples.T
        return self._of[np.argpartition(square, CANDIDATES - 1, axis=1)[:, :CANDIDATES]]


def is_closed(triangles: Float64[np.ndarray, "m 3 3"]) -> bool:
    """Return whether every edge of a mesh is passed once in each direction."""
    corners = triangles.reshape(-1, 3).round(MERGED_DIGITS) + 0.0
    _, index = np.unique(corners, axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    edges = np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)])
    forth = edges[np.lexsort(edges.T)]
    back = edges[:, ::-1]
    back = back[np.lexsort(back.T)]
    return bool(np.array_equal(forth, back))


def nearest_points(
    points: Float64[np.ndarray, "*b 3"], triangles: Float64[np.ndarray, "*b 3 3"]
) -> Float64[np.ndarray, "*b 3"]:
    """Return the point of each triangle that is nearest to a point [m]."""
    a, b, c = (triangles[..., k, :] for k in range(3))
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = _dot(u, u), _dot(u, v), _dot(v, v)
    wu, wv = _dot(w, u), _dot(w, v)
    area = np.maximum(uu * vv - uv * uv, 1e-30)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
    best = a + s[..., None] * u + t[..., None] * v
    distance = np.where(inside, _dot(points - best, points - best), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        share = _dot(points - start, edge) / np.maximum(_dot(edge, edge), 1e-30)
        on = start + np.clip(share, 0.0, 1.0)[..., None] * edge
        away = _dot(points - on, points - on)
        nearer = away < distance
        best, distance = np.where(nearer[..., None], on, best), np.minimum(away, distance)
    return best


def _dot(a: Float64[np.ndarray, "*b 3"], b: Float64[np.ndarray, "*b 3"]) -> np.ndarray:
    return np.sum(a * b, axis=-1)


def _samples(
    triangles: Float64[np.ndarray, "m 3 3"], areas: Float64[np.ndarray, "m"]
) -> tuple[Float64[np.ndarray, "s 3"], Int64[np.ndarray, "s"]]:
    """Points spread evenly over a surface, and the triangle of each."""
    share = np.cumsum(areas) / np.sum(areas)
    of = np.searchsorted(share, (np.arange(SAMPLES) + 0.5) / SAMPLES)
    of = np.concatenate([np.minimum(of, len(triangles) - 1), np.arange(len(triangles))[:SAMPLES]])
    # A low-discrepancy sequence of barycentric coordinates (plastic number).
    u, v = np.modf(np.outer(np.arange(len(of)), (0.7548776662466927, 0.5698402909980532)) + 0.5)[
        0
    ].T
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = (triangles[of, k] for k in range(3))
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), of
