"""Smaller depth images, and how much nearer a pixel is than what surrounds it."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.perception.other_ropes.relative_depth import reduced, relative_depth


@pytest.mark.parametrize("factor", [2, 3, 4])
def test_a_smaller_image_has_the_means_of_what_was_measured(factor: int) -> None:
    depth = np.random.default_rng(0).integers(800, 900, (49, 64)).astype(np.uint16)
    depth[::5, ::3] = 0
    small = reduced(depth, factor)
    height, width = small.depth.shape
    squares = depth[: factor * height, : factor * width].reshape(height, factor, width, factor)
    measured = np.count_nonzero(squares, axis=(1, 3))
    total = squares.sum(axis=(1, 3), dtype=float)
    some = measured > 0
    assert np.array_equal(small.count, measured)
    # The mean with zeros is rounded before they are left out.
    assert np.max(np.abs(small.depth[some] - total[some] / measured[some])) <= 0.5 + 0.5 * factor**2


def test_a_square_without_depth_has_the_farthest_around_it() -> None:
    depth = np.full((40, 40), 900, np.uint16)
    depth[:, :20] = 800
    depth[20:24, 18:20] = 0
    small = reduced(depth, 2)
    assert small.count[10, 9] == 0
    assert small.depth[10, 9] == 900


def test_a_strip_is_as_much_nearer_as_it_lies_before_the_table() -> None:
    depth = np.full((60, 60), 900, np.uint16)
    depth[:, 30:34] = 880
    difference = relative_depth(depth, 9)
    assert np.all(difference[10:50, 30:34] == 20)
    assert not np.any(difference[:, :30])
