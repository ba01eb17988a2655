from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle, segment_distance
from lariat.safety.constraints.line_of_sight import MAX_PENETRATION, LineOfSight
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.shapes import ShapeName


@pytest.mark.parametrize("shape", ["box", "cylinder", "capsule", "sphere"])
def test_lines_are_clear_that_do_not_come_deeper_than_they_may(shape: ShapeName) -> None:
    rng = np.random.default_rng(3)
    turn = tuple(poses.normalized(rng.normal(size=4)).tolist())
    body = Obstacle(shape, (0.1, -0.2, 0.3), turn, 0.05, 0.16, (0.1, 0.06, 0.2))
    far = [Obstacle("sphere", (5.0, 0.0, 0.0), radius=0.1), body]
    starts, ends = rng.uniform(-0.25, 0.25, (2, 3000, 3)) + np.array(body.position)
    distances = segment_distance(starts, ends, body)
    sure = np.abs(distances + MAX_PENETRATION) > 1e-4
    clear = LineOfSight(ObstacleScene(far)).clear(starts, ends)
    np.testing.assert_array_equal(clear[sure], distances[sure] > -MAX_PENETRATION)
    assert 0.2 < clear.mean() < 0.95


def test_no_line_is_clear_that_cuts_deeper_into_a_cone_than_it_may() -> None:
    rng = np.random.default_rng(4)
    body = Obstacle("cone", (0.1, -0.2, 0.3), radius=0.05, height=0.16)
    starts, ends = rng.uniform(-0.25, 0.25, (2, 3000, 3)) + np.array(body.position)
    distances = segment_distance(starts, ends, body)
    clear = LineOfSight(ObstacleScene([body])).clear(starts, ends)
    assert distances[clear].min() > -MAX_PENETRATION - 1e-5
    assert np.all(clear[distances > 1e-5])


def test_a_thin_plate_is_in_the_way() -> None:
    plate = Obstacle("box", (0.0, 0.0, 0.0), size=(1.0, 1.0, 0.0008))
    points = np.array([[0.0, 0.0, -0.1], [0.0, 0.1, 0.1]])
    assert not LineOfSight(ObstacleScene([plate])).clear(points[:1], points[1:])[0]


def test_a_solid_is_not_in_the_way_of_a_grip_inside_it_if_asked() -> None:
    ball = Obstacle("sphere", (0.0, 0.0, 0.0), radius=0.05)
    sight = LineOfSight(ObstacleScene([ball]))
    inside, outside = np.zeros((1, 3)), np.array([[0.2, 0.0, 0.0]])
    assert not sight.clear(inside, outside)[0]
    assert sight.clear(inside, outside, from_inside=True)[0]
    assert not sight.clear(outside, inside, from_inside=True)[0]
