"""Width of long thin regions of a mask."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

MIN_WIDTH = 1.5
"""Least width that is reported [pixels]."""


def usual_width(mask: UInt8[np.ndarray, "h w"]) -> float:
    """Return the width of most of a mask's area [pixels]."""
    radii = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    return width_of_most_area(radii[ridge(radii)])


def ridge(radii: Float32[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Return where the distance to the outside of a mask is largest among its neighbours.

    It is found faster than a skeleton, has gaps, and is as good for widths and shares.

    Args:
        radii: Distance of every pixel from the outside of the mask [pixels]; 0 outside.
    """
    return (radii > 0.0) & (radii >= cv2.dilate(radii, np.ones((3, 3), np.uint8)))


def width_of_most_area(radii: Float32[np.ndarray, "k"]) -> float:
    """Return the width that halves a region's area, from its skeleton's radii [pixels].

    Slivers along the edges of a region hardly change it.
    """
    ordered = np.sort(radii)
    area = np.cumsum(ordered)
    return width_from_radii(ordered[np.searchsorted(area, 0.5 * area[-1]) :][:1])


def width_from_radii(radii: Float32[np.ndarray, "k"]) -> float:
    """Return the width of a region from the distances of its skeleton to the outside [pixels]."""
    # The distance reaches to the centre of the first pixel outside.
    return max(2.0 * float(np.median(radii)) - 1.0, MIN_WIDTH) if len(radii) else MIN_WIDTH
