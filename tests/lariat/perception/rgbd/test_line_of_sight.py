from __future__ import annotations

import numpy as np

from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.perception.rgbd.line_of_sight import line_of_sight

CAMERA = Camera(Intrinsics.symmetric(160, 120, 1.0), looking_at((0.0, 0.001, 1.0), (0.0, 0.0, 0.0)))
RADIUS = 0.004


def at(*heights: float) -> np.ndarray:
    return np.array([[0.0, 0.0, z] for z in heights])


def test_a_place_in_front_of_what_is_measured_is_empty_and_one_behind_it_unknown() -> None:
    table = np.full((120, 160), 1000, np.uint16)
    sight = line_of_sight(at(0.1, 0.02, 0.004, -0.2), RADIUS, table, CAMERA)
    assert sight.past.tolist() == [True, True, False, False]
    assert sight.there.tolist() == [False, False, True, False]


def test_nothing_is_known_without_depth_or_out_of_view() -> None:
    blind = np.zeros((120, 160), np.uint16)
    sight = line_of_sight(at(0.1, -0.004), RADIUS, blind, CAMERA)
    assert not np.any(sight.past | sight.there)
    table = np.full((120, 160), 1000, np.uint16)
    aside = np.array([[3.0, 0.0, 0.1], [0.0, 0.0, 2.0]])
    beyond = line_of_sight(aside, RADIUS, table, CAMERA)
    assert not np.any(beyond.past | beyond.there)


def test_two_cameras_see_what_either_sees() -> None:
    table = np.full((120, 160), 1000, np.uint16)
    points = at(0.1, 0.0)
    both = line_of_sight(points, RADIUS, table, CAMERA) | line_of_sight(
        points, RADIUS, np.zeros_like(table), CAMERA
    )
    assert both.past.tolist() == [True, False]
    assert both.there.tolist() == [False, True]
