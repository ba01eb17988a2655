"""Motion of obstacles between waypoints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.obstacle_motion import (
    MAX_PLACES,
    SWEEP_SPACING,
    ObstacleMotion,
    obstacles_at,
    obstacles_during,
)
from lariat.geometry.obstacles import TABLE, Obstacle

CART = Obstacle("sphere", (0.0, 0.0, 0.5), radius=0.1, name="cart")
MOTION = ObstacleMotion(
    "cart", (2.0, 4.0, 5.0), ((0.0, 0.0, 0.5), (0.8, 0.0, 0.5), (0.8, 0.4, 0.5))
)


@pytest.mark.parametrize(
    ("time", "position", "velocity"),
    [
        (0.0, (0.0, 0.0, 0.5), (0.0, 0.0, 0.0)),
        (3.0, (0.4, 0.0, 0.5), (0.4, 0.0, 0.0)),
        (4.5, (0.8, 0.2, 0.5), (0.0, 0.4, 0.0)),
        (9.0, (0.8, 0.4, 0.5), (0.0, 0.0, 0.0)),
    ],
)
def test_obstacle_moves_at_a_constant_speed_between_two_waypoints(time, position, velocity):
    assert MOTION.position(time) == pytest.approx(position)
    np.testing.assert_allclose(MOTION.velocity(time), velocity, atol=1e-12)


def test_velocity_is_the_derivative_of_the_position():
    step = 1e-6
    for time in (2.3, 3.9, 4.7):
        slope = np.subtract(MOTION.position(time + step), MOTION.position(time - step)) / (2 * step)
        np.testing.assert_allclose(MOTION.velocity(time), slope, atol=1e-8)


def test_only_what_moves_has_several_places():
    present = obstacles_at([TABLE, CART], [MOTION], 3.0, 3.5)
    assert [o.name for o in present] == ["table", "cart", "cart"]
    assert [o.position[0] for o in present[1:]] == pytest.approx([0.4, 0.6])
    assert obstacles_at([TABLE, CART], [MOTION], 8.0, 9.0)[1:] == (CART.moved((0.8, 0.4, 0.5)),)


def test_places_during_a_motion_leave_no_gap_on_its_way():
    post, *carts = obstacles_during([TABLE, CART], [MOTION], 3.8, 4.3)
    places = np.array([cart.position for cart in carts])
    assert post == TABLE
    assert np.max(np.linalg.norm(np.diff(places, axis=0), axis=1)) <= SWEEP_SPACING + 1e-12
    np.testing.assert_allclose(places[[0, -1]], [(0.72, 0.0, 0.5), (0.8, 0.12, 0.5)])
    # The corner of its way is passed as well.
    assert np.min(np.linalg.norm(places - (0.8, 0.0, 0.5), axis=1)) <= 0.5 * SWEEP_SPACING


def test_many_obstacles_on_their_way_have_two_places_each():
    names = [f"cart {k}" for k in range(MAX_PLACES)]
    carts = [replace(CART, name=name) for name in names]
    motions = [replace(MOTION, name=name) for name in names]
    assert len(obstacles_during(carts, motions, 3.0, 3.5)) == 2 * len(carts)


def test_obstacle_at_rest_has_one_place():
    resting = obstacles_during([TABLE, CART], [MOTION], 8.0, 9.0)
    assert resting == (TABLE, CART.moved((0.8, 0.4, 0.5)))


@pytest.mark.parametrize(
    ("times", "message"),
    [((0.0, 0.0), "do not increase"), ((0.0, 0.5), "1.6 m/s"), ((0.0,), "1 times and 2 positions")],
)
def test_impossible_motion_is_refused(times, message):
    with pytest.raises(ValueError, match=message):
        ObstacleMotion("cart", times, MOTION.positions[:2])
