"""Near pairs are those that the signed distances imply."""

from __future__ import annotations

import numpy as np

from lariat.geometry.near_pairs import near_pairs
from lariat.geometry.obstacles import TABLE, Obstacle, signed_distance


def test_near_pairs_are_those_within_reach() -> None:
    points = np.random.default_rng(0).uniform(-0.2, 0.2, size=(200, 3))
    obstacles = (TABLE, Obstacle("sphere", (0.0, 0.0, 0.1), radius=0.05))
    found = near_pairs(points, obstacles, np.full(200, 0.03))
    expected = sum(int(np.sum(signed_distance(points, o) < 0.03)) for o in obstacles)
    assert len(found.points) == expected > 10
    # A step along the normals gains its own length.
    for k, distance, normal in zip(found.points, found.distances, found.normals, strict=True):
        moved = points[k] + 1e-6 * normal
        gains = [float(signed_distance(moved[None], o)[0]) - distance for o in obstacles]
        assert min(abs(g - 1e-6) for g in gains) < 1e-9
