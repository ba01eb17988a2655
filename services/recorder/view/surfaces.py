"""Points on the surfaces of obstacles, from the table of shapes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.shapes import SHAPES, SolidName
from services.recorder.view.primitives import HALF_SPACE_SIDE, half_space_pose

POINT_SPACING = 0.01
"""Distance between neighbouring points [m], where the body is small enough."""
MAX_POINTS_PER_LINE = 40
"""Most points along an edge of a face."""
SIDES = 12
"""Number of flat faces around a round body, whose points are then put on its surface."""

Points = Float64[np.ndarray, "n 3"]
"""Points in the world or in the obstacle's frame [m]."""


def surface_points(obstacle: Obstacle) -> Points:
    """Return points on the surface of an obstacle, in the world."""
    if obstacle.shape == "half_space":
        line = np.linspace(-0.5, 0.5, MAX_POINTS_PER_LINE) * HALF_SPACE_SIDE
        x, y = map(np.ravel, np.meshgrid(line, line))
        return half_space_pose(obstacle).apply(np.stack([x, y, np.zeros_like(x)], axis=-1))
    pose = Pose(np.array(obstacle.position), np.array(obstacle.orientation))
    return pose.apply(_local(obstacle.shape, *obstacle.packed_sizes.tolist()))


@lru_cache(maxsize=256)
def _local(shape: SolidName, *sizes: float) -> Points:
    """Points on the surface of a body in its own frame."""
    row, packed = SHAPES[shape], np.array(sizes)
    mesh = row.mesh(packed, SIDES)
    corners = mesh.points[mesh.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    length = float(np.linalg.norm(edges, axis=2).max())
    count = int(np.clip(length / POINT_SPACING, 1, MAX_POINTS_PER_LINE - 1)) + 1
    shares = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, count)] * 2), axis=-1).reshape(-1, 2)
    shares = shares[shares.sum(axis=1) < 1.0 + 1e-9]
    points = (corners[:, :1] + shares @ edges).reshape(-1, 3)
    # One in each cell of a grid: triangles meet, and may be narrow.
    cells = np.round(points / POINT_SPACING).astype(int) @ (1, 1 << 20, 1 << 40)
    points = points[np.unique(cells, return_index=True)[1]]
    # The flat faces of a round body lie within it.
    return points - row.distance(packed, points)[:, None] * row.gradient(packed, points)
