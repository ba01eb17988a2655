from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.scenario.distractors import Distractor
from lariat.simulation.distractors import MovingTubes
from shared import topics
from tests.services.perception.cell import Cell, scenario


def test_a_tube_moves_evenly_between_its_times_and_stands_still_outside() -> None:
    moving = Distractor(
        points=((0.0, 0.0, 0.3), (0.4, 0.0, 0.3)),
        times=(1.0, 3.0),
        shifts=((0.0, 0.0, 0.0), (0.0, 0.2, -0.1)),
    )
    at = [MovingTubes([moving]).at(t)[0].nodes[0] for t in (0.0, 1.0, 2.0, 3.0, 9.0)]
    expected = [[0.0, y, 0.3 - y / 2.0] for y in (0.0, 0.0, 0.1, 0.2, 0.2)]
    np.testing.assert_allclose(at, expected, atol=1e-12)


def test_three_points_are_joined_by_a_smooth_curve_through_them() -> None:
    points = ((-0.2, 0.0, 0.3), (0.0, 0.1, 0.3), (0.2, 0.0, 0.3))
    (tube,) = MovingTubes([Distractor(points=points, diameter=0.006)]).at(0.0)
    assert tube.radius == 0.003
    assert np.max(np.min(polylines.point_distances(np.array(points), tube.nodes), axis=1)) < 5e-3
    turns = np.diff(tube.nodes, axis=0)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    assert np.min(np.sum(turns[1:] * turns[:-1], axis=1)) > np.cos(np.radians(12.0))


def test_the_camera_sees_a_distractor_that_no_topic_names() -> None:
    red = "\n[[distractors]]\npoints = [[-0.1, -0.1, 0.2], [0.1, -0.1, 0.2]]\ncolor = [200, 0, 0]\n"
    cells = [Cell(scenario(text)) for text in ("", red)]
    for cell in cells:
        cell.run(0.2)
    key = topics.CAMERA_COLOR.at(DEFAULT_CAMERA).key
    plain, with_tube = (cell.has_subscribers[key][-1].data for cell in cells)
    assert plain != with_tube
    scenes = [cell.has_subscribers[topics.SCENE_STATE.key][-1].obstacles for cell in cells]
    assert scenes[0] == scenes[1]


@pytest.mark.parametrize(
    ("times", "shifts", "message"),
    [
        ((1.0,), (), "1 times for 0 shifts"),
        ((2.0, 1.0), ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)), "must rise"),
    ],
)
def test_a_motion_that_is_none_is_refused(times: tuple, shifts: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Distractor(points=((0.0, 0.0, 0.3), (0.4, 0.0, 0.3)), times=times, shifts=shifts)


def test_an_axis_of_one_point_is_refused() -> None:
    with pytest.raises(ValueError, match="two"):
        Distractor(points=((0.0, 0.0, 0.3),))
