from __future__ import annotations

import numpy as np
import pytest

from dashboard.scene.obstacle_view import top_height
from lariat.geometry import obstacles, poses
from lariat.geometry.obstacles import Obstacle

TILTED = tuple(poses.exponential(np.array([0.4, -0.7, 0.2])).tolist())


@pytest.mark.parametrize(
    "body",
    [
        Obstacle("cylinder", (0.0, 0.0, 0.0), TILTED, radius=0.03, height=0.16),
        Obstacle("capsule", (0.0, 0.0, 0.0), TILTED, radius=0.03, height=0.16),
        Obstacle("sphere", (0.0, 0.0, 0.0), TILTED, radius=0.03),
        Obstacle("box", (0.0, 0.0, 0.0), TILTED, size=(0.05, 0.1, 0.2)),
    ],
)
def test_top_height_is_that_of_the_highest_point(body: Obstacle) -> None:
    axis = np.linspace(-0.15, 0.15, 121)
    x, y = np.meshgrid(axis, axis)
    for height, inside in ((top_height(body) + 0.001, False), (top_height(body) - 0.004, True)):
        plane = np.stack([x, y, np.full_like(x, height)], axis=-1)
        assert np.any(obstacles.signed_distance(plane, body) < 0.0) == inside
