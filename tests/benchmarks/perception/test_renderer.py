"""Rendered pictures of cables and their labels."""

from __future__ import annotations

import numpy as np

from benchmarks.perception.pictures.generators import rendered_picture
from benchmarks.perception.pictures.renderer import Cable, Lighting, paint_cables

LIGHT = Lighting((0.0, 0.0, 1.0), 0.5, 0.0, 30.0, 0.0, 0.5)


def straight(angle: float, height: float, width: float = 12.0) -> Cable:
    s = np.arange(-120.0, 121.0)
    axis = np.stack([160.0 + s * np.cos(angle), 120.0 + s * np.sin(angle)], axis=1)
    return Cable(axis, np.full(len(s), height), width, (200, 60, 60))


def test_label_area_is_length_times_width() -> None:
    ground = np.full((240, 320, 3), 128.0, np.float32)
    _, labels = paint_cables(ground, [straight(0.3, 0.0)], LIGHT)
    assert abs(np.count_nonzero(labels) / 240.0 - 12.0) < 0.5


def test_higher_cable_covers_the_lower_one_whatever_their_order() -> None:
    ground = np.full((240, 320, 3), 128.0, np.float32)
    low, high = straight(0.3, 0.0), straight(-0.9, 2.0)
    _, labels = paint_cables(ground, [low, high], LIGHT)
    assert labels[120, 160] == 2
    _, labels = paint_cables(ground, [high, low], LIGHT)
    assert labels[120, 160] == 1


def test_pictures_are_those_of_their_seed() -> None:
    one, same = rendered_picture(3, 2, "plain"), rendered_picture(3, 2, "plain")
    assert np.array_equal(one.color, same.color)
    assert set(np.unique(one.labels)) == {0, 1, 2}
