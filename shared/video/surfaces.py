"""Faces of convex bodies, to be painted."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.shapes import SHAPES, SolidName


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
    """Return the surface of a body that has one."""
    return _local(body.shape, *body.packed_sizes.tolist()).moved(body)


@lru_cache(maxsize=256)
def _local(shape: SolidName, *sizes: float) -> Surface:
    """Surface of a body in its own frame."""
    mesh = SHAPES[shape].mesh(np.array(sizes))
    corners = [mesh.points[list(face)] for face in mesh.faces]
    ends = tuple(itertools.accumulate(map(len, corners)))
    return Surface(np.concatenate(corners), ends, np.array([_normal(face) for face in corners]))


def _normal(corners: Float64[np.ndarray, "k 3"]) -> Float64[np.ndarray, "3"]:
    """Return the outward normal of a flat face."""
    area = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    return area / max(float(np.linalg.norm(area)), 1e-12)
