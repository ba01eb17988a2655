from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle
from shared.constraints.shortest_path import shortest_path_length

HALF = 0.3
LEFT, RIGHT = np.array([-HALF, 0.0, 0.5]), np.array([HALF, 0.0, 0.5])


@pytest.mark.parametrize("radius", [0.02, 0.1, 0.2])
def test_path_round_a_post_is_two_tangents_with_an_arc(radius: float) -> None:
    post = Obstacle("cylinder", (0.0, 0.0, 0.5), radius=radius, height=4.0)
    exact = 2.0 * np.sqrt(HALF**2 - radius**2) + radius * 2.0 * np.arcsin(radius / HALF)
    assert np.isclose(shortest_path_length(LEFT, RIGHT, [TABLE, post]), exact, rtol=1e-3)


@pytest.mark.parametrize("radius", [0.02, 0.1, 0.2])
def test_path_round_a_box_is_three_straight_lines(radius: float) -> None:
    box = Obstacle("box", (0.0, 0.0, 0.5), size=(2.0 * radius, 2.0 * radius, 1.0))
    exact = 2.0 * np.hypot(HALF - radius, radius) + 2.0 * radius
    assert exact - 1e-3 <= shortest_path_length(LEFT, RIGHT, [TABLE, box]) <= 1.01 * exact


def test_path_is_straight_beside_an_obstacle_and_goes_over_a_low_one() -> None:
    beside = Obstacle("sphere", (0.0, 0.11, 0.5), radius=0.1)
    assert shortest_path_length(LEFT, RIGHT, [TABLE, beside]) == 2.0 * HALF
    low = Obstacle("box", (0.0, 0.0, 0.26), size=(0.02, 10.0, 0.52))
    assert np.isclose(
        shortest_path_length(LEFT, RIGHT, [low]),
        2.0 * np.hypot(HALF - 0.01, 0.02) + 0.02,
        rtol=5e-3,
    )
