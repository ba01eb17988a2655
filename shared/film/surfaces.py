"""Faces of convex bodies, to be painted."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle

SIDES = 28
"""Number of points on the circle of a round body."""
RINGS = 10
"""Number of rings of a rounded body from pole to pole, an even number."""


@dataclass(frozen=True)
class Surface:
    """Faces of a body; the convex hull of their points is the body."""

    points: Float64[np.ndarray, "p 3"]
    """Corners of all faces, one face after the other [m]."""
    ends: tuple[int, ...]
    """Index in `points` behind the last corner of each face."""
    normals: Float64[np.ndarray, "f 3"]
    """Outward normals."""

    def moved(self, body: Obstacle) -> Surface:
        """Return the surface at the pose of a body."""
        turn = np.array(body.orientation)
        points = poses.rotate(turn, self.points) + np.array(body.position)
        return Surface(points, self.ends, poses.rotate(turn, self.normals))


def surface(body: Obstacle) -> Surface:
    """Return the surface of a box, cylinder, sphere or capsule."""
    return _local(body.shape, body.radius, body.height, body.size).moved(body)


@lru_cache(maxsize=256)
def _local(shape: str, radius: float, height: float, size: tuple[float, float, float]) -> Surface:
    """Surface of a body in its own frame."""
    faces = _box(np.array(size)) if shape == "box" else _round(shape, radius, height)
    ends = tuple(itertools.accumulate(len(corners) for corners, _ in faces))
    return Surface(
        np.concatenate([corners for corners, _ in faces]),
        ends,
        np.array([normal for _, normal in faces]),
    )


def _box(size: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    signs = np.array([[a, b] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))], float)
    return [
        (np.insert(signs, axis, sign, axis=1) * size / 2.0, sign * np.eye(3)[axis])
        for axis in range(3)
        for sign in (-1.0, 1.0)
    ]


def _round(shape: str, radius: float, height: float) -> list[tuple[np.ndarray, np.ndarray]]:
    angles = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    around = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(SIDES)])
    half = 0.0 if shape == "sphere" else height / 2.0
    flat = shape == "cylinder"
    latitudes = np.zeros(2) if flat else np.linspace(-np.pi / 2.0, np.pi / 2.0, RINGS)
    rings = []
    for k, latitude in enumerate(latitudes):
        middle = half if k >= len(latitudes) // 2 else -half
        lift = np.array([0.0, 0.0, np.sin(latitude) * radius + middle])
        rings.append(np.cos(latitude) * radius * around + lift)
    faces = []
    for low, high in itertools.pairwise(rings):
        for k in range(SIDES):
            after = (k + 1) % SIDES
            face = np.array([low[k], low[after], high[after], high[k]])
            axis_point = np.array([0.0, 0.0, np.clip(face[:, 2].mean(), -half, half)])
            normal = face.mean(0) - axis_point
            faces.append((face, normal / max(float(np.linalg.norm(normal)), 1e-9)))
    if flat:
        up = np.array([0.0, 0.0, 1.0])
        faces += [(rings[-1], up), (rings[0], -up)]
    return faces
