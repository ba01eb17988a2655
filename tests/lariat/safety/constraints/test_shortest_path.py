from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle, signed_distance
from lariat.safety.constraints.line_of_sight import LineOfSight
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.shortest_path import (
    PathSearch,
    ShortPath,
    joined,
    shortest_path_length,
)

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
    assert exact - 1.5e-3 <= shortest_path_length(LEFT, RIGHT, [TABLE, box]) <= exact + 1e-3


def test_path_is_straight_beside_an_obstacle_and_goes_over_a_low_one() -> None:
    beside = Obstacle("sphere", (0.0, 0.11, 0.5), radius=0.1)
    assert shortest_path_length(LEFT, RIGHT, [TABLE, beside]) == 2.0 * HALF
    low = Obstacle("box", (0.0, 0.0, 0.26), size=(0.02, 10.0, 0.52))
    assert np.isclose(
        shortest_path_length(LEFT, RIGHT, [low]),
        2.0 * np.hypot(HALF - 0.01, 0.02) + 0.02,
        rtol=5e-3,
    )


WALLS = tuple(
    Obstacle("box", (side * 0.508, 0.0, 0.7), size=(1.0, 0.03, 1.4), name=f"wall{side:+g}")
    for side in (-1.0, 1.0)
)
"""Wall with a slit of 16 mm."""


def _searched(right_x: float, known: ShortPath | None, max_length: float) -> tuple[ShortPath, int]:
    """Path through the slit of the wall, whose right end lies aside, and the steps it takes."""
    search = PathSearch(
        np.array([0.0, -0.2, 0.4]), np.array([right_x, 0.2, 0.4]), WALLS, known, max_length
    )
    for steps in range(1, 100_000):
        found, _ = search.advance(1)
        if found is not None:
            return found, steps
    raise AssertionError("the search does not end")


def test_a_slit_is_found_by_the_path_that_led_through_it_before() -> None:
    straight, _ = _searched(0.0, None, 1.0)
    without, steps = _searched(0.02, None, 1.0)
    found, fewer = _searched(0.02, straight, 1.0)
    assert np.hypot(0.4, 0.02) < found.length < without.length + 0.001
    assert 2 * fewer < steps


def test_a_known_path_that_is_too_long_gives_way_to_a_shorter_one() -> None:
    post = Obstacle("cylinder", (0.0, 0.0, 0.4), radius=0.05, height=0.8)
    left, right = np.array([-0.3, 0.04, 0.4]), np.array([0.3, 0.04, 0.4])
    around = np.array([left, [0.0, -0.06, 0.4], right])
    known = ShortPath(around[[0, -1]], around, 0.7)
    search = PathSearch(left, right, (post,), known, 0.605)
    found, _ = search.advance(100_000)
    assert found is not None
    assert found.length == pytest.approx(shortest_path_length(left, right, (post,)))
    assert found.length < 0.605


def test_ends_join_a_known_path_where_the_lines_to_it_are_clear() -> None:
    box = Obstacle("box", (0.0, 0.0, 0.3), size=(0.1, 0.1, 4.0))
    ends = np.array([[-HALF, 0.0, 0.3], [HALF, 0.0, 0.3]])
    search, found = PathSearch(*ends, [box]), None
    while found is None:
        found, _ = search.advance(1000)
    moved = ends + np.array([[0.02, 0.0, 0.05], [-0.05, 0.01, 0.0]])
    path = joined(found, moved, LineOfSight(ObstacleScene([box])))
    assert path is not None
    assert path.points is not None
    np.testing.assert_array_equal(path.points[[0, -1]], moved)
    steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    np.testing.assert_allclose(path.length, steps.sum())
    shortest = shortest_path_length(*moved, [box])
    assert shortest - 1e-3 < path.length < shortest + 0.01
    assert np.min(signed_distance(path.points, box)) > -1.6e-3
    # Ends between walls join nothing.
    walls = [
        Obstacle("box", (x, 0.0, 0.3), size=(0.005, 4.0, 4.0)) for x in (-HALF - 0.1, -HALF - 0.2)
    ]
    between = ends - np.array([0.15, 0.0, 0.0])
    assert joined(found, between, LineOfSight(ObstacleScene([box, *walls]))) is None


def test_a_path_that_begins_inside_an_obstacle_is_joined_by_none() -> None:
    ball = Obstacle("sphere", (-HALF, 0.0, 0.3), radius=0.05)
    ends = np.array([[-HALF, 0.0, 0.3], [HALF, 0.0, 0.3]])
    through = ShortPath.straight(ends)
    behind = ends - np.array([[0.1, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert joined(through, behind, LineOfSight(ObstacleScene([ball]))) is None
    assert joined(through, behind, LineOfSight(ObstacleScene())) is not None
