"""Distance of points from a triangle mesh."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

MAX_PAIRS = 500_000
"""Number of points times triangles that are compared at once."""
EXACT_COST = 8
"""Cost of an exact distance from a triangle, in distances from the disc around one."""
MAX_NEAR = 20_000
"""Largest number of triangles that may be the nearest to a point, on average over some points; of
the surface of a body it is some hundreds, of triangles that cross each other all."""
SAME_DISTANCE = 1e-9
"""Difference of two distances below which both triangles are the nearest [m]."""
ROUNDING = 1e-6
"""Error that the distances of points from centres may have by rounding [m]."""
MERGED_DIGITS = 7
"""Decimals of the coordinates by which corners of triangles are one vertex."""


class MeshDistance:
    """Exact distance from a mesh: discs around the triangles tell which cannot be the nearest."""

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
        self.triangles = triangles[kept]
        self._normals = normals[kept] / areas[kept, None]
        self._closed = is_closed(self.triangles)
        if self._closed and np.sum(np.linalg.det(self.triangles)) < 0.0:
            self._normals = -self._normals
        self._centres = self.triangles.mean(axis=1)
        away = np.linalg.norm(self.triangles - self._centres[:, None], axis=2)
        self._radii = away.max(axis=1)
        self.compared = 0
        """Cost so far, in distances of a point from the disc around a triangle."""

    def outside(self, points: Float64[np.ndarray, "p 3"]) -> Float64[np.ndarray, "p"]:
        """Return the distance of points from the mesh [m]; zero inside a closed one.

        Args:
            points: Points in the frame of the mesh [m].

        Raises:
            ValueError: The triangles are no surface of a body, and distances would take minutes.
        """
        size = max(MAX_PAIRS // len(self.triangles), 1)
        parts = [points[k : k + size] for k in range(0, len(points), size)]
        return np.concatenate([self._outside(part) for part in parts]) if parts else np.zeros(0)

    def _outside(self, points: Float64[np.ndarray, "p 3"]) -> Float64[np.ndarray, "p"]:
        square = np.sum(self._centres**2, axis=1) - 2.0 * points @ self._centres.T
        square += np.sum(points**2, axis=1)[:, None]
        bound = self._distance(points, square.argmin(axis=1)) + ROUNDING
        of, which = np.nonzero(square <= (bound[:, None] + self._radii) ** 2)
        self.compared += len(of)
        if len(of) > MAX_NEAR * len(points):
            raise ValueError(
                f"more than {MAX_NEAR} of {len(self.triangles)} triangles may be the nearest to a "
                "place: they are large and cross each other; give the surface of a body"
            )
        to_discs = self._to_discs(points[of], which)
        starts = np.searchsorted(of, np.arange(len(points)))
        first = np.nonzero(to_discs == np.minimum.reduceat(to_discs, starts)[of])[0]
        first = first[np.searchsorted(of[first], np.arange(len(points)))]
        bound = np.minimum(bound, self._distance(points, which[first]) + ROUNDING)
        near = to_discs <= bound[of]
        of, which = of[near], which[near]
        self.compared += EXACT_COST * len(of)
        away = points[of] - nearest_points(points[of], self.triangles[which])
        distance = np.linalg.norm(away, axis=1)
        starts = np.searchsorted(of, np.arange(len(points)))
        least = np.minimum.reduceat(distance, starts)
        if not self._closed:
            return least
        side = np.einsum("pk,pk->p", away, self._normals[which])
        beyond = (side > 0.0) & (distance <= least[of] + SAME_DISTANCE)
        return np.where(np.logical_or.reduceat(beyond, starts), least, 0.0)

    def _distance(self, points: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Distance of each point from a triangle [m]."""
        return np.linalg.norm(points - nearest_points(points, self.triangles[which]), axis=1)

    def _to_discs(self, points: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Distance of each point from the disc around a triangle, less than from the triangle."""
        away = points - self._centres[which]
        across = _dot(away, self._normals[which])
        along = np.sqrt(np.maximum(_dot(away, away) - across**2, 0.0)) - self._radii[which]
        return np.hypot(across, np.maximum(along, 0.0))


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
