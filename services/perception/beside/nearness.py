"""Pixels of a depth image that are nearer than what surrounds them on both sides."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import UInt8, UInt16

SMOOTHING = 3
"""Side of the mean that is taken before depths are compared [pixels]."""
NOISE_SIGMAS = 3.0
"""Difference that noise makes, in standard deviations of a single depth [-]: the closing takes the
farthest of some hundred means of nine."""


def nearness(
    depth: UInt16[np.ndarray, "h w"], max_width: int
) -> tuple[UInt16[np.ndarray, "h w"], UInt16[np.ndarray, "h w"]]:
    """Return how much nearer each pixel is than what lies around it, and the depths compared [mm].

    The closing of the image by a square, less the image (black top-hat, Meyer 1979): what is at
    most as wide as the square, and nearer than anything on both sides of it, is large. Steps
    between wide surfaces are not.

    Args:
        depth: Depth image [mm], 0 where nothing was measured.
        max_width: Side of the square [pixels].
    """
    # The farthest neighbour stands for a pixel without a depth, lest it look near.
    farthest = cv2.dilate(depth, np.ones((5, 5), np.uint8))
    filled = cv2.blur(np.where(depth > 0, depth, farthest), (SMOOTHING, SMOOTHING))
    closed = cv2.morphologyEx(filled, cv2.MORPH_CLOSE, np.ones((max_width, max_width), np.uint8))
    difference = cv2.subtract(closed, filled)
    # Beside the border, one side is out of view: a slope that falls away from it would look near.
    rim = max_width // 2
    framed = np.zeros_like(difference)
    framed[rim:-rim, rim:-rim] = difference[rim:-rim, rim:-rim]
    return framed, filled


def near_mask(
    difference: UInt16[np.ndarray, "h w"], least: float, depth_sigma: float
) -> UInt8[np.ndarray, "h w"]:
    """Return 1 at pixels that are nearer than their surroundings by more than noise.

    Args:
        difference: How much nearer each pixel is [mm].
        least: Least difference that counts [m].
        depth_sigma: Standard deviation of a single depth [m].
    """
    threshold = 1e3 * max(least, NOISE_SIGMAS * depth_sigma)
    return (difference > threshold).view(np.uint8)
