"""Segmentation of the rope's pixels, by brightness or by colour."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from lariat.geometry.cameras import Picture

Color = tuple[int, int, int]
"""Red, green, blue, 0..255."""


@dataclass(frozen=True)
class ColorLikenessSettings:
    """Colour table, and search of the threshold between rope and background."""

    channel_bits: int = 5
    """Bits of each channel that the colour table distinguishes."""
    shade_range: tuple[float, float] = (0.6, 1.15)
    """Darkest and brightest shade of the rope, relative to its given colour."""
    pixel_stride: int = 4
    """Stride of the rows and columns from which the histogram is made [pixels]."""
    share_range: tuple[float, float] = (0.3, 3.0)
    """Range of the share of rope pixels, relative to the expected one, at which the threshold is
    searched."""
    threshold_range: tuple[int, int] = (12, 120)
    """Range of the threshold [colour levels]."""
    histogram_window: int = 9
    """Width of the running mean over the histogram [colour levels]."""


@dataclass(frozen=True)
class Region:
    """Bounding region of all pixels that look like rope."""

    likeness: UInt8[np.ndarray, "h w"]
    """Likeness of every pixel to the rope, 0..255."""
    mask: UInt8[np.ndarray, "h w"]
    """1 at rope pixels."""
    left: int
    """First column of the region in the whole image."""
    top: int
    """First row of the region in the whole image."""


def brightness(color: Picture) -> UInt8[np.ndarray, "h w"]:
    """Return the brightness of every pixel."""
    return color if color.ndim == 2 else cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)


class ColorLikeness:
    """Likeness of pixels to the rope's colour, scaled to the background at hand.

    Pixels are compared with all shades of the rope's colour. The distance at which rope and
    background are equally likely is found in each image, at the minimum of the histogram of
    distances; it is mapped to a likeness of 128.
    """

    def __init__(self, rope: Color, settings: ColorLikenessSettings | None = None) -> None:
        """
        Args:
            rope: Colour of the rope in full light.
            settings: Colour table and search for the threshold.
        """
        self._settings = settings or ColorLikenessSettings()
        self._distance = _shade_distances(np.array(rope, float), self._settings)

    def __call__(self, color: UInt8[np.ndarray, "h w 3"], share: float) -> UInt8[np.ndarray, "h w"]:
        """Return the likeness of every pixel, 0..255.

        Args:
            color: Red, green, blue.
            share: Share of the image that the rope is expected to cover.
        """
        stride, bits = self._settings.pixel_stride, self._settings.channel_bits
        sampled = self._distance[_table_indices(color[::stride, ::stride], bits)]
        threshold = self._threshold(np.bincount(sampled.ravel(), minlength=256), share)
        scale = 255.0 * (1.0 - self._distance / (2.0 * threshold))
        return np.clip(scale, 0.0, 255.0).astype(np.uint8)[_table_indices(color, bits)]

    def _threshold(self, histogram: np.ndarray, share: float) -> float:
        """Distance at the minimum of a histogram of distances."""
        s = self._settings
        below = np.cumsum(histogram) / np.sum(histogram)
        window = np.ones(s.histogram_window) / float(s.histogram_window)
        smooth = np.convolve(histogram, window, "same")
        at = np.arange(256)
        fewest, most = s.share_range
        allowed = (below >= fewest * share) & (below <= most * share)
        allowed &= (at >= s.threshold_range[0]) & (at <= s.threshold_range[1])
        if not np.any(allowed):
            # The rope is hidden, or much of the image has its colour: the expected share decides.
            return float(np.clip(np.searchsorted(below, share), *s.threshold_range))
        # The middle of the minimum, where that is flat.
        lowest = np.flatnonzero(allowed & (smooth <= np.min(smooth[allowed]) + 0.5))
        return float(lowest[len(lowest) // 2])


def _table_indices(color: UInt8[np.ndarray, "h w 3"], bits: int) -> np.ndarray:
    """Index of every pixel into the colour table."""
    parts = color >> (8 - bits)
    cells = parts[..., 0].astype(np.uint16) << (2 * bits)
    cells |= parts[..., 1].astype(np.uint16) << bits
    cells |= parts[..., 2]
    return cells


def _shade_distances(
    rope: Float64[np.ndarray, "3"], settings: ColorLikenessSettings
) -> UInt8[np.ndarray, "c"]:
    """Distance of every colour of the table from the nearest shade of the rope, 0..255."""
    step = 1 << (8 - settings.channel_bits)
    axis = np.arange(0, 256, step) + (step - 1) / 2.0
    colors = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    along = colors @ rope / max(float(rope @ rope), 1.0)
    nearest = np.clip(along, *settings.shade_range)[:, None] * rope
    distance = np.linalg.norm(colors - np.minimum(nearest, 255.0), axis=1)
    return np.minimum(distance, 255.0).astype(np.uint8)


def segment_rope(
    likeness: UInt8[np.ndarray, "h w"], threshold: int, min_pixels: int = 25, margin: int = 6
) -> Region | None:
    """Return the region of all rope pixels, without specks; None when there are none.

    Args:
        likeness: Likeness of every pixel to the rope.
        threshold: Least likeness of a rope pixel, 1..254.
        min_pixels: Area below which a connected component is noise [pixels].
        margin: Margin around the rope pixels [pixels].
    """
    mask = (likeness >= threshold).view(np.uint8)
    x, y, w, h = cv2.boundingRect(mask)
    if w == 0 or h == 0:
        return None
    left, top = max(x - margin, 0), max(y - margin, 0)
    part = np.s_[top : y + h + margin, left : x + w + margin]
    mask = mask[part]
    count, labels = cv2.connectedComponents(mask, connectivity=8)
    # Counted by OpenCV, areas take longer than the components.
    areas = np.bincount(labels[mask.view(bool)], minlength=count)
    kept = areas >= min_pixels
    kept[0] = False
    if not np.any(kept):
        return None
    if np.count_nonzero(kept) < count - 1:
        mask = kept[labels].view(np.uint8)
    return Region(likeness[part], mask, left, top)
