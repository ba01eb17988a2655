"""Several ropes in one image: number, order along each, and who lies on top."""

from __future__ import annotations

import numpy as np
import pytest
from jaxtyping import Float64

from benchmarks.perception.pictures import grounds
from benchmarks.perception.pictures.renderer import Cable, Lighting, as_photograph, paint_cables
from lariat.perception.image.detector import Detection, detect_ropes
from lariat.perception.lines.segmentation import Color

LIGHT = Lighting((-0.45, -0.45, 0.77), 0.45, 40.0, 30.0, 0.25, 0.5)
RED, BLUE, YELLOW = (200, 50, 50), (50, 80, 200), (230, 200, 60)
GREY = (120, 122, 124)


def wave(
    start: tuple[float, float], stop: tuple[float, float], amplitude: float, turns: float = 1.0
) -> Float64[np.ndarray, "k 2"]:
    t = np.linspace(0.0, 1.0, 700)[:, None]
    way = np.subtract(stop, start)
    across = np.array([-way[1], way[0]]) / np.linalg.norm(way)
    return start + t * way + amplitude * np.sin(2.0 * np.pi * turns * t) * across


def taken(cables: list[Cable], seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    ground = grounds.plain_ground(random, (640, 480), GREY, 0.01)
    picture, _ = paint_cables(ground, cables, LIGHT)
    return as_photograph(picture, random, 0.7, 0.0, 3.0, 90)


def cable(axis: Float64[np.ndarray, "k 2"], color: Color, height: float = 0.0) -> Cable:
    return Cable(axis, np.full(len(axis), height), 12.0, color)


def worst_distance(axis: Float64[np.ndarray, "k 2"], found: Detection) -> float:
    """Largest distance between an axis and the line of the rope that lies nearest to it."""
    worst = []
    for rope in found.ropes:
        (line,) = rope.lines
        gap = np.linalg.norm(axis[::5, None] - line.pixels[None], axis=2)
        worst.append(max(float(gap.min(axis=1).max()), float(gap.min(axis=0).max())))
    return min(worst)


@pytest.mark.parametrize("colors", [(RED, BLUE), (YELLOW, YELLOW)])
@pytest.mark.parametrize("rise", [110.0, 330.0])
def test_two_crossing_cables_are_two_ropes_with_one_line_each(
    colors: tuple[Color, Color], rise: float
) -> None:
    one = wave((60.0, 240.0 - rise / 2.0), (580.0, 240.0 + rise / 2.0), 20.0)
    two = wave((60.0, 240.0 + rise / 2.0), (580.0, 240.0 - rise / 2.0), 15.0)
    found = detect_ropes(taken([cable(one, colors[0]), cable(two, colors[1], 2.0)]))
    assert len(found.ropes) == 2
    assert worst_distance(one, found) < 6.0
    assert worst_distance(two, found) < 6.0


def test_points_are_in_order_through_a_loop() -> None:
    t = np.linspace(0.0, 1.0, 900)
    x = 80.0 + 480.0 * t + 90.0 * np.sin(2.0 * np.pi * 2.0 * (t - 0.25)) * np.sin(np.pi * t)
    y = 260.0 - 110.0 * np.cos(2.0 * np.pi * 2.0 * (t - 0.25)) * np.sin(np.pi * t)
    axis = np.stack([x, y], axis=1)
    found = detect_ropes(taken([Cable(axis, 3.0 * t, 12.0, YELLOW)]))
    (rope,) = found.ropes
    (line,) = rope.lines
    nearest = np.argmin(np.linalg.norm(line.pixels[::6, None] - axis[None], axis=2), axis=1)
    # At a crossing two parts of the axis are as near: the order holds beside it.
    steps = np.diff(nearest) * np.sign(nearest[-1] - nearest[0])
    assert np.mean(steps > 0) > 0.97


@pytest.mark.parametrize("upper", [0, 1])
@pytest.mark.parametrize("colors", [(RED, BLUE), (YELLOW, YELLOW)])
def test_upper_rope_of_a_crossing_is_named(colors: tuple[Color, Color], upper: int) -> None:
    one, two = wave((60.0, 100.0), (580.0, 380.0), 20.0), wave((100.0, 420.0), (560.0, 60.0), 10.0)
    heights = (2.0, 0.0) if upper == 0 else (0.0, 2.0)
    cables = [cable(one, colors[0], heights[0]), cable(two, colors[1], heights[1])]
    found = detect_ropes(taken(cables))
    (crossing,) = found.crossings
    assert crossing.known
    on_top = found.ropes[crossing.ropes[0]].lines[0].pixels
    distance = [np.min(np.linalg.norm(on_top[5] - axis, axis=1)) for axis in (one, two)]
    assert int(np.argmin(distance)) == upper


def test_a_given_colour_selects_its_rope_though_another_crosses_it() -> None:
    one, two = wave((60.0, 100.0), (580.0, 380.0), 20.0), wave((100.0, 420.0), (560.0, 60.0), 10.0)
    picture = taken([cable(one, RED), cable(two, BLUE, 2.0)])
    for color, axis in ((RED, one), (BLUE, two)):
        found = detect_ropes(picture, color)
        assert len(found.ropes) == 1
        assert worst_distance(axis, found) < 6.0


def test_width_of_a_clean_cable_is_measured() -> None:
    axis = wave((60.0, 240.0), (580.0, 240.0), 60.0)
    (rope,) = detect_ropes(taken([cable(axis, BLUE)])).ropes
    assert abs(rope.width - 12.0) < 1.0


def test_width_is_right_though_the_dark_flank_is_lost_in_the_ground() -> None:
    axis = wave((60.0, 240.0), (580.0, 240.0), 60.0)
    random = np.random.default_rng(0)
    ground = grounds.plain_ground(random, (640, 480), (34, 34, 36), 0.01)
    light = Lighting((-0.6, -0.6, 0.53), 0.3, 20.0, 30.0, 0.3, 0.5)
    picture, _ = paint_cables(ground, [cable(axis, (110, 108, 104))], light)
    (rope,) = detect_ropes(as_photograph(picture, random, 0.7, 0.0, 3.0, 90)).ropes
    # The half in the light alone is 8 pixels wide.
    assert abs(rope.width - 12.0) < 1.6


def test_ends_of_one_colour_that_face_each_other_across_the_ground_are_of_two_ropes() -> None:
    one, two = wave((40.0, 240.0), (300.0, 240.0), 25.0), wave((344.0, 240.0), (600.0, 240.0), 25.0)
    found = detect_ropes(taken([cable(one, YELLOW), cable(two, YELLOW)]))
    assert len(found.ropes) == 2


def test_a_rope_that_leaves_the_image_for_a_short_way_is_one_rope() -> None:
    t = np.linspace(0.0, 1.0, 900)
    axis = np.stack([60.0 + 520.0 * t, -11.0 + 300.0 * np.abs(2.0 * t - 1.0) ** 2], axis=1)
    (rope,) = detect_ropes(taken([cable(axis, RED)])).ropes
    (line,) = rope.lines
    assert np.ptp(line.pixels[:, 0]) > 500.0


def test_a_loop_whose_turn_is_cut_off_by_the_border_is_one_rope() -> None:
    t = np.linspace(-4.0, 4.0, 1200)
    axis = np.stack([320.0 + 30.0 * t - 90.0 * np.sin(t), 81.0 - 90.0 * np.cos(t)], axis=1)
    (rope,) = detect_ropes(taken([cable(axis, RED)])).ropes
    (line,) = rope.lines
    ends = line.pixels[[0, -1]]
    ends = ends[np.argsort(ends[:, 0])]
    assert np.linalg.norm(ends - axis[[0, -1]], axis=1).max() < 20.0


def test_two_ropes_of_one_colour_that_leave_the_image_side_by_side_are_two() -> None:
    one, two = wave((171.0, 329.0), (301.0, -30.0), 0.0), wave((469.0, 329.0), (339.0, -30.0), 0.0)
    assert len(detect_ropes(taken([cable(one, RED), cable(two, RED)])).ropes) == 2


def test_labels_end_where_the_cable_is_cut_off() -> None:
    axis = np.stack([np.linspace(150.0, 490.0, 700), np.linspace(160.0, 330.0, 700)], axis=1)
    along = np.array([340.0, 170.0]) / np.hypot(340.0, 170.0)
    half = 0.5 * np.hypot(340.0, 170.0)
    wide = Cable(axis, np.zeros(len(axis)), 26.0, YELLOW)
    wrong = []
    for seed in range(4):
        random = np.random.default_rng(seed)
        ground = grounds.plain_ground(random, (640, 480), GREY, 0.01)
        picture, labels = paint_cables(ground, [wide], LIGHT)
        found = detect_ropes(as_photograph(picture, random, 0.7, 0.0, 3.0, 90))
        rows, columns = np.nonzero(labels != found.labels)
        beyond = np.abs((np.stack([columns, rows], axis=1) - axis.mean(axis=0)) @ along)
        wrong.append(np.count_nonzero(np.abs(beyond - half) < 13.0))
    # Wrong pixels near both cut faces; tips that bend towards corners have 300 of them.
    assert np.mean(wrong) < 220
