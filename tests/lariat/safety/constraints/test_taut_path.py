from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle, segment_distance
from lariat.safety.constraints.line_of_sight import MAX_PENETRATION, LineOfSight
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.taut_path import string_pulled

POST = Obstacle("cylinder", (0.0, 0.0, 0.0), radius=0.1, height=4.0)
BOX = Obstacle("box", (0.0, 0.0, 0.0), size=(0.2, 0.2, 2.0))


def tight(points: list[list[float]], body: Obstacle) -> np.ndarray:
    """Path pulled tight round a body, whose lines stay outside."""
    pulling = string_pulled(np.array(points), LineOfSight(ObstacleScene([body])))
    for _ in range(200):
        try:
            next(pulling)
        except StopIteration as end:
            path: np.ndarray = end.value
            least = segment_distance(path[:-1], path[1:], body).min()
            assert least > -MAX_PENETRATION - 1e-6
            return path
    raise AssertionError("the path is never tight")


@pytest.mark.parametrize("height", [0.0, 0.2])
def test_path_round_a_post_slides_along_it(height: float) -> None:
    angles = np.pi * (1.0 + np.linspace(0.15, 0.85, 12))
    arc = [[0.101 * np.cos(a), 0.101 * np.sin(a), height] for a in angles]
    path = tight([[-0.25, 0.0, 0.0], *arc, [0.25, 0.0, 0.0]], POST)
    exact = 2.0 * np.sqrt(0.25**2 - 0.1**2) + 0.2 * np.arcsin(0.1 / 0.25)
    assert polylines.length(path) == pytest.approx(exact, abs=1e-3)


def test_path_round_a_box_slides_along_its_edges() -> None:
    corners = [[-0.1, 0.1, 0.1], [0.1, 0.1, 0.05]]
    path = tight([[-0.3, 0.0, 0.0], *corners, [0.3, 0.0, 0.0]], BOX)
    assert polylines.length(path) == pytest.approx(2.0 * np.hypot(0.2, 0.1) + 0.2, abs=1.5e-3)


def test_path_that_nothing_holds_becomes_straight() -> None:
    path = tight([[-0.3, 0.2, 0.0], [0.0, 0.4, 0.0], [0.3, 0.2, 0.0]], BOX)
    np.testing.assert_allclose(path, [[-0.3, 0.2, 0.0], [0.3, 0.2, 0.0]])
