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
    """Means [mm]; where no depth is around, one from farther around."""
    count: Float32[np.ndarray, "h w"] | UInt8[np.ndarray, "h w"]
    """Number of depths that each is the mean of; 0 without any."""


def smoothed(depth: UInt16[np.ndarray, "h w"]) -> SmoothDepth:
    """Return the means over the square around every pixel.

    Args:
        depth: Depth image [mm], 0 where nothing was measured.
    """
    measured = (depth > 0).view(np.uint8)
    total, count = _sum(depth, SMOOTHING), _sum(measured, SMOOTHING)
    return SmoothDepth(_filled(cv2.divide(total, count), count, depth, measured, HOLE_SIDE), count)


def reduced(depth: UInt16[np.ndarray, "h w"], factor: int) -> SmoothDepth:
    """Return a smaller image: the mean of each square of so many pixels.

    A square without any depth has the farthest one around it.

    Args:
        depth: Depth image [mm], 0 where nothing was measured; rows and columns that are left over
            at its end are left out.
        factor: Side of the squares [pixels], up to 11.
    """
    height, width = depth.shape[0] // factor, depth.shape[1] // factor
    depth, size = depth[: factor * height, : factor * width], (width, height)
    # Its mean over a square is the number of depths.
    measured = (depth > 0).view(np.uint8) * np.uint8(factor**2)
    mean = cv2.resize(depth, size, interpolation=cv2.INTER_AREA)
    count = cv2.resize(measured, size, interpolation=cv2.INTER_AREA)
    part = np.flatnonzero(count < factor**2)
    some = np.maximum(count.ravel()[part], 1)
    mean.ravel()[part] = np.rint(mean.ravel()[part] * (float(factor**2) / some))
    holes = np.flatnonzero(count == 0)
    if len(holes):
        side = HOLE_SIDE // factor | 1
        around = cv2.dilate(mean, np.ones((side, side), np.uint8)).ravel()[holes]
        mean.ravel()[holes] = np.where(around > 0, around, np.iinfo(np.uint16).max)
    return SmoothDepth(mean, count)


def relative_depth(depth: UInt16[np.ndarray, "h w"], max_width: int) -> UInt16[np.ndarray, "h w"]:
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
    smooth: SmoothDepth,
    least: float,
    depth_sigma: float,
    max_depth: float,
) -> UInt8[np.ndarray, "h w"]:
    """Return 1 at pixels that are nearer than their surroundings by more than noise.

    Args:
        difference: How much nearer each pixel is [mm].
        smooth: Depths that were compared; no pixel without a depth around it is near.
        least: Least difference that counts [m].
        depth_sigma: Standard deviation of a single depth [m].
        max_depth: Depth beyond which no pixel counts [m].
    """
    mask = np.zeros(difference.shape, np.uint8)
    # Few pixels are nearer at all; whole numbers are compared several at a time.
    at = np.flatnonzero(difference > int(1e3 * least))
    near, count = difference.ravel()[at].astype(np.float32), smooth.count.ravel()[at]
    # Squared, so that no root is taken; without depths around a pixel, the product is zero.
    surely = near * near * count > (1e3 * NOISE_SIGMAS * depth_sigma) ** 2
    surely &= smooth.depth.ravel()[at] <= 1e3 * max_depth
    mask.ravel()[at[surely]] = 1
    return mask


def _filled(
    mean: np.ndarray,
    count: np.ndarray,
    depth: UInt16[np.ndarray, "h w"],
    measured: UInt8[np.ndarray, "h w"],
    side: int,
) -> UInt16[np.ndarray, "h w"]:
    """Means, of larger squares where they are of no depth; the farthest depth where those are."""
    holes = np.flatnonzero(count == 0)
    if len(holes):
        around, weights = (_sum(image, side).ravel()[holes] for image in (depth, measured))
        farthest = np.iinfo(np.uint16).max
        mean.ravel()[holes] = np.where(weights > 0.0, around / np.maximum(weights, 1.0), farthest)
    return mean.astype(np.uint16, copy=False)


def _sum(image: UInt8[np.ndarray, "h w"] | UInt16[np.ndarray, "h w"], side: int) -> np.ndarray:
    """Sum over a square around every pixel."""
    return cv2.boxFilter(image, cv2.CV_32F, (side, side), normalize=False)
