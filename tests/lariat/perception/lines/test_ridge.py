from __future__ import annotations

import numpy as np
import pytest

from lariat.perception.lines.ridge import extract_ridge, sample_depth
from lariat.perception.lines.segmentation import Region, segment_rope
from lariat.perception.lines.skeleton import trace_strands

WIDTH = 8.0


def profile(row: float) -> np.ndarray:
    """Image of a horizontal rope with its axis at a fractional row."""
    rows = np.arange(80)[:, None] * np.ones((1, 160))
    return np.clip(255.0 * (WIDTH / 2.0 + 0.5 - np.abs(rows - row)), 0.0, 255.0).astype(np.uint8)


def region(row: float) -> Region:
    found = segment_rope(profile(row), 128)
    assert found is not None
    return found


@pytest.mark.parametrize("row", [40.0, 40.3, 40.5, 40.8])
def test_the_axis_is_accurate_to_a_twentieth_of_a_pixel(row: float) -> None:
    rope = region(row)
    (strand,) = trace_strands(rope.mask, WIDTH)
    depth = np.full((80, 160), 900, np.uint16)
    ridge = extract_ridge(strand, rope, depth, WIDTH)
    inner = ridge.pixels[10:-10]
    assert np.max(np.abs(inner[:, 1] - row)) < 0.05
    assert np.all(ridge.clear[10:-10])
    np.testing.assert_allclose(np.abs(ridge.normals[10:-10, 1]), 1.0, atol=1e-6)


def test_mixed_pixels_behind_the_rope_do_not_change_its_depth() -> None:
    rope = region(40.0)
    (strand,) = trace_strands(rope.mask, WIDTH)
    depth = np.full((80, 160), 900, np.uint16)
    depth[:, ::3] = 1200
    depth[:, ::7] = 0
    ridge = extract_ridge(strand, rope, depth, WIDTH)
    assert np.all(ridge.depth == 0.9)


def test_depth_outside_the_image_is_zero() -> None:
    depth = np.full((4, 6), 500, np.uint16)
    found = sample_depth(depth, np.array([[0.0, 0.0], [5.4, 3.4], [-0.6, 1.0], [5.6, 1.0]]))
    assert found.tolist() == [0.5, 0.5, 0.0, 0.0]
