"""Motion of obstacles between waypoints."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacle_motion import ObstacleMotion, obstacles_at
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


@pytest.mark.parametrize(
    ("times", "message"),
    [((0.0, 0.0), "do not increase"), ((0.0, 1.0), "0.8 m/s"), ((0.0,), "1 times and 2 positions")],
)
def test_impossible_motion_is_refused(times, message):
    with pytest.raises(ValueError, match=message):
        ObstacleMotion("cart", times, MOTION.positions[:2])
