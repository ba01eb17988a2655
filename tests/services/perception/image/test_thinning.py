from __future__ import annotations

import cv2
import numpy as np
import pytest

from services.perception.image.thinning import skeletonize

BLOT = """
..######........
.########..##...
.###..####.###..
.##....#######..
.###..#########.
..############..
...#####..####..
....###....##...
"""
SKELETON = """
....##..........
...#..#....#....
..#....#...#....
..#.....#..#....
..#....#####....
...##.#.....#...
.....#..........
................
"""


def mask(picture: str) -> np.ndarray:
    return np.array([[c == "#" for c in row] for row in picture.split()])


@pytest.mark.parametrize("width", [1, 3, 6, 11])
def test_a_thick_line_becomes_one_of_single_pixels_along_its_axis(width: int) -> None:
    drawn = np.zeros((60, 200), np.uint8)
    cv2.line(drawn, (20, 30), (180, 30), 1, width)
    rows, columns = np.nonzero(skeletonize(drawn.view(bool)))
    assert np.all(np.abs(rows - 30) <= 1)
    assert len(columns) == len(set(columns)) >= 160 - width


def test_thinning_keeps_connections_and_holes() -> None:
    rng = np.random.default_rng(3)
    noise = cv2.GaussianBlur(rng.random((120, 160)).astype(np.float32), (0, 0), 2.0)
    before = noise > 0.5
    after = skeletonize(before)
    assert not np.any(after & ~before)
    for inverted, connectivity in ((False, 8), (True, 4)):
        counts = [
            cv2.connectedComponents((m ^ inverted).view(np.uint8), connectivity=connectivity)[0]
            for m in (np.pad(before, 1), np.pad(after, 1))
        ]
        assert counts[0] == counts[1]


def test_skeleton_is_that_of_scikit_image() -> None:
    np.testing.assert_array_equal(skeletonize(mask(BLOT)), mask(SKELETON))
