from __future__ import annotations

import cv2
import numpy as np

from lariat.perception.lines.skeleton import trace_branches, trace_strands

WIDTH = 7


def mask(*lines: list[tuple[int, int]]) -> np.ndarray:
    """Polylines of the rope's width through columns and rows."""
    drawn = np.zeros((160, 240), np.uint8)
    for line in lines:
        cv2.polylines(drawn, [np.array(line, np.int32)[:, None]], False, 1, WIDTH)
    return drawn


def test_one_line_is_one_clear_strand_from_end_to_end() -> None:
    (strand,) = trace_strands(mask([(30, 80), (200, 80)]), WIDTH)
    assert np.all(strand.clear)
    assert np.all(np.abs(strand.pixels[:, 1] - 80) <= 1)
    assert sorted(strand.pixels[[0, -1], 0])[0] < 35
    assert sorted(strand.pixels[[0, -1], 0])[1] > 195
    assert np.max(np.abs(np.diff(strand.pixels, axis=0))) == 1


def test_two_lines_are_two_strands_longest_first() -> None:
    long, short = trace_strands(mask([(30, 40), (200, 40)], [(30, 110), (120, 110)]), WIDTH)
    assert np.all(np.abs(long.pixels[:, 1] - 40) <= 1)
    assert np.all(np.abs(short.pixels[:, 1] - 110) <= 1)
    assert len(long.pixels) > len(short.pixels)


def test_strands_go_straight_through_their_crossing_and_are_not_clear_there() -> None:
    found = trace_strands(mask([(30, 80), (210, 80)], [(120, 10), (120, 150)]), WIDTH)
    assert len(found) == 2
    for strand, axis, centre in zip(found, (1, 0), (80, 120), strict=True):
        away = np.abs(strand.pixels[:, 1 - axis] - (120 if axis == 1 else 80))
        assert np.all(np.abs(strand.pixels[:, axis] - centre) <= 3)
        assert np.ptp(strand.pixels[:, 1 - axis]) > 120
        assert not np.any(strand.clear[away < WIDTH / 2])
        assert np.all(strand.clear[away > 3 * WIDTH])


def test_a_short_spur_is_removed() -> None:
    (strand,) = trace_strands(mask([(30, 80), (200, 80)], [(115, 80), (115, 73)]), WIDTH)
    assert np.all(np.abs(strand.pixels[:, 1] - 80) <= 2)


def test_a_speck_has_no_strand() -> None:
    speck = np.zeros((60, 60), np.uint8)
    speck[30:32, 30:32] = 1
    assert trace_strands(speck, WIDTH) == []


def test_a_line_at_the_edge_of_the_image_is_traced_to_its_corners() -> None:
    corners = np.zeros((40, 60), bool)
    corners[0, :] = corners[:, -1] = True
    (branch,) = trace_branches(corners)
    assert branch.ends == (-1, -1)
    assert {branch.pixels[0], branch.pixels[-1]} == {(0, 0), (39, 59)}
    assert len(set(branch.pixels)) == 40 + 60 - 1
