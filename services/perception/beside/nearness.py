"""Pixels of a depth image that are nearer than what surrounds them on both sides."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float32, UInt8, UInt16

SMOOTHING = 3
"""Side of the mean that is taken before depths are compared [pixels]."""
HOLE_SMOOTHING = 15
"""Side of the mean that stands for pixels without any depth around them [pixels]."""
NOISE_SIGMAS = 9.0
"""Difference that noise makes, in standard deviations of the mean of the depths [-]: the closing
takes the farthest of some hundred means."""


def nearness(
    depth: UInt16[np.ndarray, "h w"], max_width: int
) -> tuple[UInt16[np.ndarray, "h w"], UInt16[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """Return how much nearer each pixel is than what lies around it, and the depths compared [mm].

    The closing of the image by a square, less the image (black top-hat, Meyer 1979): what is at
    most as wide as the square, and nearer than anything on both sides of it, is large. Steps
    between wide surfaces are not. The third image is the number of depths that each of the depths
    compared is the mean of.

    Args:
        depth: Depth image [mm], 0 where nothing was measured.
        max_width: Side of the square [pixels].
    """
    measured = (depth > 0).view(np.uint8)
    total, count = (_sum(image, SMOOTHING) for image in (depth, measured))
    mean = cv2.divide(total, count)
    holes = count == 0.0
    if np.any(holes):
        around, known = (_sum(image, HOLE_SMOOTHING)[holes] for image in (depth, measured))
        farthest = np.iinfo(np.uint16).max
        mean[holes] = np.where(known > 0.0, around / np.maximum(known, 1.0), farthest)
    filled = mean.astype(np.uint16)
    closed = cv2.morphologyEx(filled, cv2.MORPH_CLOSE, np.ones((max_width, max_width), np.uint8))
    difference = cv2.subtract(closed, filled)
    # Beside the border, one side is out of view: a slope that falls away from it would look near.
    rim = max_width // 2
    framed = np.zeros_like(difference)
    framed[rim:-rim, rim:-rim] = difference[rim:-rim, rim:-rim]
    return framed, filled, count


def near_mask(
    difference: UInt16[np.ndarray, "h w"],
    count: Float32[np.ndarray, "h w"],
    least: float,
    depth_sigma: float,
) -> UInt8[np.ndarray, "h w"]:
    """Return 1 at pixels that are nearer than their surroundings by more than noise.

    Args:
        difference: How much nearer each pixel is [mm].
        count: Number of depths that it is the mean of; no pixel without a depth around it is near.
        least: Least difference that counts [m].
        depth_sigma: Standard deviation of a single depth [m].
    """
    near = difference.astype(np.float32)
    # Squared, so that no root is taken; without depths around a pixel, the product is zero.
    surely = near * near * count > (1e3 * NOISE_SIGMAS * depth_sigma) ** 2
    return (surely & (difference > 1e3 * least)).view(np.uint8)


def _sum(image: UInt8[np.ndarray, "h w"] | UInt16[np.ndarray, "h w"], side: int) -> np.ndarray:
    """Sum over a square around every pixel."""
    return cv2.boxFilter(image, cv2.CV_32F, (side, side), normalize=False)
