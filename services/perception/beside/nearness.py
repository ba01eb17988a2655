"""Pixels of a depth image that are nearer than what surrounds them on both sides."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, UInt8, UInt16

SMOOTHING = 3
"""Side of the mean that is taken before depths are compared [pixels]."""
HOLE_SIDE = 15
"""Side of the mean that stands for pixels without any depth around them [pixels]."""
NOISE_SIGMAS = 9.0
"""Difference that noise makes, in standard deviations of the mean of the depths [-]: the closing
takes the farthest of some hundred means."""


@dataclass(frozen=True)
class SmoothDepth:
    """Means of neighbouring depths."""

    depth: UInt16[np.ndarray, "h w"]
    """Means [mm]; around pixels without any depth, of a larger square."""
    count: Float32[np.ndarray, "h w"]
    """Number of depths that each is the mean of; 0 without any."""


def smoothed(depth: UInt16[np.ndarray, "h w"]) -> SmoothDepth:
    """Return the means over the square around every pixel.

    Args:
        depth: Depth image [mm], 0 where nothing was measured.
    """
    measured = (depth > 0).view(np.uint8)
    total, count = _sum(depth, SMOOTHING), _sum(measured, SMOOTHING)
    return SmoothDepth(_filled(cv2.divide(total, count), count, depth, measured, HOLE_SIDE), count)


def halved(depth: UInt16[np.ndarray, "h w"]) -> SmoothDepth:
    """Return an image of half the width and height: the mean of each square of two by two pixels.

    Args:
        depth: Depth image [mm], 0 where nothing was measured; a last odd row or column is left out.
    """
    height, width = depth.shape[0] // 2, depth.shape[1] // 2
    depth, size = depth[: 2 * height, : 2 * width], (width, height)
    measured = (depth > 0).view(np.uint8) * np.uint8(4)
    mean = cv2.resize(depth, size, interpolation=cv2.INTER_AREA)
    count = cv2.resize(measured, size, interpolation=cv2.INTER_AREA)
    part = count < 4
    if np.any(part):
        mean[part] = 4.0 * mean[part] / np.maximum(count[part], 1)
        known = (count > 0).view(np.uint8)
        mean = _filled(mean, count, mean, known, HOLE_SIDE // 2 | 1)
    return SmoothDepth(mean, count.astype(np.float32))


def nearness(depth: UInt16[np.ndarray, "h w"], max_width: int) -> UInt16[np.ndarray, "h w"]:
    """Return how much nearer each pixel is than what lies around it [mm].

    The closing of the image by a square, less the image (black top-hat, Meyer 1979): what is at
    most as wide as the square, and nearer than anything on both sides of it, is large. Steps
    between wide surfaces are not.

    Args:
        depth: Smoothed depths [mm].
        max_width: Side of the square [pixels].
    """
    closed = cv2.morphologyEx(depth, cv2.MORPH_CLOSE, np.ones((max_width, max_width), np.uint8))
    difference = cv2.subtract(closed, depth)
    # Beside the border, one side is out of view: a slope that falls away from it would look near.
    rim = max_width // 2
    difference[:rim], difference[-rim:] = 0, 0
    difference[:, :rim], difference[:, -rim:] = 0, 0
    return difference


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


def _filled(
    mean: np.ndarray,
    count: np.ndarray,
    depth: UInt16[np.ndarray, "h w"],
    measured: UInt8[np.ndarray, "h w"],
    side: int,
) -> UInt16[np.ndarray, "h w"]:
    """Means, of larger squares where they are of no depth; the farthest depth where those are."""
    holes = count == 0
    if np.any(holes):
        around, known = (_sum(image, side)[holes] for image in (depth, measured))
        farthest = np.iinfo(np.uint16).max
        mean[holes] = np.where(known > 0.0, around / np.maximum(known, 1.0), farthest)
    return mean.astype(np.uint16, copy=False)


def _sum(image: UInt8[np.ndarray, "h w"] | UInt16[np.ndarray, "h w"], side: int) -> np.ndarray:
    """Sum over a square around every pixel."""
    return cv2.boxFilter(image, cv2.CV_32F, (side, side), normalize=False)
