"""Shadows that lie along ropes, which the network takes in part for the rope."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from jaxtyping import UInt8

from lariat.perception.image.color_model import without_shadow
from lariat.perception.image.flanks import center_between_flanks
from lariat.perception.lines.segmentation import Color

GROUND, SHADOW = (200, 198, 194), (128, 127, 124)
ROPE = np.s_[60:72]
"""Rows of the rope: 12 pixels, whose middle is 65.5."""
WITH_SHADOW = np.s_[60:80]
"""Rows that the network takes for the rope."""


def shaded(color: Color) -> UInt8[np.ndarray, "h w 3"]:
    """Lab image of a straight rope that lies along the rows, with its shadow below it."""
    picture = np.full((140, 300, 3), GROUND, np.uint8)
    picture[60:84] = SHADOW
    picture[ROPE] = color
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2LAB), np.uint8)


def test_flank_lies_between_rope_and_shadow_though_both_are_foreground() -> None:
    evidence = np.full((140, 300), -4.0, np.float32)
    evidence[WITH_SHADOW] = 4.0
    columns = np.arange(20.0, 280.0)
    pixels = np.stack([columns, np.full(260, 69.5)], axis=1)
    normals, clear = np.tile([0.0, 1.0], (260, 1)), np.ones(260, bool)
    lab = shaded((230, 195, 50)).astype(np.float32)
    axis, width = center_between_flanks(lab, evidence, pixels, normals, clear, 20.0)
    assert width == pytest.approx(12.0, abs=0.7)
    assert np.abs(axis[:, 1] - 65.5).max() < 0.5


def test_width_is_not_that_of_a_bright_highlight_on_a_dark_rope() -> None:
    lab = np.full((140, 300, 3), (60.0, 128.0, 128.0), np.float32)
    lab[60:80, :, 0] = 45.0
    lab[63:77, :, 0] = 230.0
    lab = cv2.GaussianBlur(lab, (0, 0), 1.0)
    evidence = np.full((140, 300), -4.0, np.float32)
    evidence[60:80] = 4.0
    columns = np.arange(20.0, 280.0)
    pixels = np.stack([columns, np.full(260, 69.5)], axis=1)
    normals, clear = np.tile([0.0, 1.0], (260, 1)), np.ones(260, bool)
    _, width = center_between_flanks(lab, evidence, pixels, normals, clear, 20.0)
    assert width == pytest.approx(20.0, abs=1.5)


@pytest.mark.parametrize(("color", "kept"), [((230, 195, 50), 0.15), ((120, 120, 118), 1.0)])
def test_shadow_of_a_coloured_rope_is_no_example_of_it_but_a_grey_rope_is(
    color: Color, kept: float
) -> None:
    mask = np.zeros((140, 300), np.uint8)
    mask[WITH_SHADOW] = 1
    lit = without_shadow(shaded(color), mask, 14.0)
    assert lit[61:71].mean() == 1.0
    assert lit[74:80].mean() == pytest.approx(kept, abs=0.15)
