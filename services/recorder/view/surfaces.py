"""Points on the surfaces of obstacles."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, outward_normals, signed_distance
from lariat.geometry.poses import Pose
from services.recorder.view.primitives import HALF_SPACE_SIDE, half_space_pose

POINT_SPACING = 0.01
"""Distance between neighbouring points [m], where the body is small enough."""
MAX_POINTS_PER_LINE = 40
"""Most points along the edge of a triangle or in a row."""

Points = Float64[np.ndarray, "n 3"]
"""Points [m]."""


def surface_points(obstacle: Obstacle) -> Points:
    """Return points on the surface of an obstacle, in the world."""
    if obstacle.shape == "half_space":
        line = _line(HALF_SPACE_SIDE)
        return half_space_pose(obstacle).apply(_grid(line, line))
    pose = Pose(np.array(obstacle.position), np.array(obstacle.orientation))
    mesh = obstacle.row.mesh(obstacle.packed_sizes)
    points = pose.apply(np.concatenate([_inside(mesh.points[t]) for t in mesh.triangles]))
    # The faces of a mesh lie inside round surfaces.
    return points - signed_distance(points, obstacle)[:, None] * outward_normals(points, obstacle)


def _inside(corners: Float64[np.ndarray, "3 3"]) -> Points:
    """Return points of a triangle, its corners among them."""
    first, second = corners[1:] - corners[0]
    a, b = (len(_line(float(np.linalg.norm(edge)))) for edge in (first, second))
    shares = np.stack(np.meshgrid(np.linspace(0, 1, a), np.linspace(0, 1, b)), axis=-1)
    shares = shares.reshape(-1, 2)[shares.reshape(-1, 2).sum(axis=1) < 1.0 + 1e-9]
    return corners[0] + shares @ np.stack([first, second])


def _line(length: float) -> Float64[np.ndarray, "k"]:
    count = int(np.clip(length / POINT_SPACING, 1, MAX_POINTS_PER_LINE - 1)) + 1
    return np.linspace(-0.5 * length, 0.5 * length, count)


def _grid(first: Float64[np.ndarray, "a"], second: Float64[np.ndarray, "b"]) -> Points:
    x, y = np.meshgrid(first, second)
    return np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
