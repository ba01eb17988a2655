"""Foreground of an image: its skeleton at the border, and its holes."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from jaxtyping import Float32

from lariat.perception.image import foreground
from lariat.perception.image.foreground import Foreground, find_foregrounds


def seen(monkeypatch: pytest.MonkeyPatch, odds: Float32[np.ndarray, "h w"]) -> Foreground:
    """Foreground of a grey image in which the network sees given log odds."""
    picture = np.where(odds[..., None] > 0.0, 200, 90).astype(np.uint8).repeat(3, axis=2)
    monkeypatch.setattr(foreground, "rope_log_odds", lambda _: odds)
    (found,) = find_foregrounds(picture)
    return found


def band(points: list[tuple[int, int]], width: int) -> Float32[np.ndarray, "h w"]:
    """Log odds of a rope through points."""
    mask = np.zeros((300, 400), np.uint8)
    cv2.polylines(mask, [np.array(points)], False, 1, width)
    return np.where(mask > 0, 4.0, -4.0).astype(np.float32)


def test_skeleton_of_a_rope_that_leaves_the_image_does_not_fork(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    skeleton = seen(monkeypatch, band([(120, -60), (170, 150), (150, 360)], 24)).skeleton
    for row in (0, 4, 8, 291, 295, 299):
        (columns,) = np.nonzero(skeleton[row])
        assert len(columns) > 0
        assert np.ptp(columns) < 6


@pytest.mark.parametrize(("odds", "filled"), [(-4.5, False), (-2.0, True)])
def test_a_small_hole_is_filled_unless_the_network_sees_ground_in_it(
    monkeypatch: pytest.MonkeyPatch, odds: float, filled: bool
) -> None:
    log_odds = band([(20, 150), (380, 150)], 40)
    picture = np.where(log_odds[..., None] > 0.0, 200, 90).astype(np.uint8).repeat(3, axis=2)
    hole = np.s_[146:154, 180:230]
    log_odds[hole], picture[hole] = odds, 90
    monkeypatch.setattr(foreground, "rope_log_odds", lambda _: log_odds)
    (found,) = find_foregrounds(picture)
    assert bool(found.mask[150, 205]) == filled
