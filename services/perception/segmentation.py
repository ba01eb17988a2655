"""Which pixels are rope."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import UInt8


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


def bright_region(
    color: UInt8[np.ndarray, "h w 3"], threshold: int, least_pixels: int = 25, margin: int = 6
) -> Region | None:
    """Everything brighter than a threshold, without specks; None when nothing is.

    Args:
        color: Red, green, blue.
        threshold: Least brightness of the rope, 1..254.
        least_pixels: Smaller spots are noise.
        margin: Dark pixels kept around the region.
    """
    grey = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)
    mask = (grey >= threshold).view(np.uint8)
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
    return Region(grey[part], mask, left, top)
