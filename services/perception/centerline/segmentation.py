"""Which pixels are rope: the bright ones, or those of its colour."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

Color = tuple[int, int, int]

BITS = 5
"""Of each channel that a colour table tells apart."""
SHADES = (0.6, 1.15)
"""How dark and how bright a rope's colour is seen, against the given one."""
SPARSE = 4
"""Every so many-th row and column says how colours are spread."""
FEWEST, MOST = 0.3, 3.0
"""Of the expected share of rope pixels: between them a threshold is sought."""
NARROWEST, WIDEST = 12, 120
"""Colour distances between which a threshold lies."""


@dataclass(frozen=True)
class Region:
    """The part of an image that holds everything that looks like rope."""

    brightness: UInt8[np.ndarray, "h w"]
    """How much every pixel looks like rope, 0..255."""
    mask: UInt8[np.ndarray, "h w"]
    """1 where it is taken for rope."""
    left: int
    """Column of the whole image in which the region begins."""
    top: int
    """Row of the whole image in which the region begins."""


def brightness(color: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w"]:
    """How bright every pixel is."""
    return cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)


class ColorLikeness:
    """How much pixels have the rope's colour, on a scale that fits the background at hand.

    Colours are compared with all shades of the rope's. The distance at which a pixel is as much
    background as rope is found in each image, where the fewest pixels lie: 128 stands for it.
    """

    def __init__(self, rope: Color) -> None:
        """
        Args:
            rope: Its colour in full light.
        """
        self._distance = _distances(np.array(rope, float))

    def __call__(self, color: UInt8[np.ndarray, "h w 3"], share: float) -> UInt8[np.ndarray, "h w"]:
        """Likeness of every pixel, 0..255.

        Args:
            color: Red, green, blue.
            share: Part of the image that the rope is expected to cover.
        """
        sparse = self._distance[_cells(color[::SPARSE, ::SPARSE])]
        middle = self._threshold(np.bincount(sparse.ravel(), minlength=256), share)
        scale = 255.0 * (1.0 - self._distance / (2.0 * middle))
        return np.clip(scale, 0.0, 255.0).astype(np.uint8)[_cells(color)]

    @staticmethod
    def _threshold(histogram: np.ndarray, share: float) -> float:
        below = np.cumsum(histogram) / np.sum(histogram)
        smooth = np.convolve(histogram, np.ones(9) / 9.0, "same")
        at = np.arange(256)
        allowed = (below >= FEWEST * share) & (below <= MOST * share)
        allowed &= (at >= NARROWEST) & (at <= WIDEST)
        if not np.any(allowed):
            # Hidden, or among much of its own colour: as strict as its share asks for.
            return float(np.clip(np.searchsorted(below, share), NARROWEST, WIDEST))
        # In the middle of the valley, when it is flat.
        lowest = np.flatnonzero(allowed & (smooth <= np.min(smooth[allowed]) + 0.5))
        return float(lowest[len(lowest) // 2])


def _cells(color: UInt8[np.ndarray, "h w 3"]) -> np.ndarray:
    """Where in a table of colours every pixel looks."""
    parts = color >> (8 - BITS)
    cells = parts[..., 0].astype(np.uint16) << (2 * BITS)
    cells |= parts[..., 1].astype(np.uint16) << BITS
    cells |= parts[..., 2]
    return cells


def _distances(rope: Float64[np.ndarray, "3"]) -> UInt8[np.ndarray, "c"]:
    """Of every colour of the table from the nearest shade of the rope's, 0..255."""
    step = 1 << (8 - BITS)
    axis = np.arange(0, 256, step) + (step - 1) / 2.0
    colors = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    along = colors @ rope / max(float(rope @ rope), 1.0)
    nearest = np.clip(along, *SHADES)[:, None] * rope
    away = np.linalg.norm(colors - np.minimum(nearest, 255.0), axis=1)
    return np.minimum(away, 255.0).astype(np.uint8)


def rope_region(
    likeness: UInt8[np.ndarray, "h w"], threshold: int, least_pixels: int = 25, margin: int = 6
) -> Region | None:
    """Everything that looks like rope, without specks; None when nothing does.

    Args:
        likeness: How much every pixel looks like rope.
        threshold: From which on it counts, 1..254.
        least_pixels: Smaller spots are noise.
        margin: Other pixels kept around the region.
    """
    mask = (likeness >= threshold).view(np.uint8)
    x, y, w, h = cv2.boundingRect(mask)
    if w == 0 or h == 0:
        return None
    left, top = max(x - margin, 0), max(y - margin, 0)
    part = np.s_[top : y + h + margin, left : x + w + margin]
    mask = mask[part]
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    kept = stats[:, cv2.CC_STAT_AREA] >= least_pixels
    kept[0] = False
    if not np.any(kept):
        return None
    if np.count_nonzero(kept) < count - 1:
        mask = kept[labels].view(np.uint8)
    return Region(likeness[part], mask, left, top)
