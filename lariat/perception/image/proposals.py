"""Proposals: long thin regions of an image that may be pieces of a rope."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from lariat.perception.image.width import MIN_WIDTH

MEDIAN_WINDOWS = (0.04, 0.1, 0.25)
"""Widths of the windows of the median with which a pixel is compared, as shares of the image's
longer side; a rope is narrower than half of one."""
MIN_CONTRAST = 10.0
"""Least colour distance of a region from that median [Lab]."""
CLUSTER_COUNT = 9
"""Number of colour clusters into which an image is divided."""
CLUSTER_CHANNEL_WEIGHTS = (0.6, 1.3, 1.3)
"""Weights of lightness and both chromas in the distance between colours of the clusters."""
CLUSTER_SAMPLES = 6000
"""Approximate number of pixels from which the clusters are computed."""
MIN_ASPECT = 6.0
"""Least length of a region over its width."""
MIN_LENGTH = 0.12
"""Least length of a region, as a share of the image's longer side."""
COLOR_DISTANCES = (8.0, 14.0, 22.0, 34.0)
"""Distances up to which a pixel has a given colour, strictest first [Lab]."""
SHADE_RANGE = (0.4, 1.2)
"""Darkest and brightest shade of a given colour."""
DARKENING_DISTANCE = 45.0
"""Distance between a colour and its shade of brightness zero [Lab]."""
STRIPE_LENGTH = 11
"""Length of gaps between regions of a colour that are closed [pixels]."""
MAX_PROPOSALS = 3
"""Largest number of proposals from one mask."""


def propose(lab: UInt8[np.ndarray, "h w 3"]) -> Iterator[UInt8[np.ndarray, "h w"]]:
    """Yield masks of long thin regions, found by contrast to their surroundings and by colour.

    Args:
        lab: Image in Lab, as OpenCV scales it, a few hundred pixels wide.
    """
    longer = max(lab.shape[:2])
    for share in MEDIAN_WINDOWS:
        # The median keeps light and table, and removes regions thinner than half its window.
        around = cv2.medianBlur(lab, 2 * int(share * longer / 2.0) + 1)
        difference = lab.astype(np.float32) - around
        contrast = np.minimum(np.linalg.norm(difference, axis=2), 255.0).astype(np.uint8)
        least = max(MIN_CONTRAST, float(cv2.threshold(contrast, 0, 255, cv2.THRESH_OTSU)[0]))
        yield from _long_components(contrast > least)
        yield from _long_components((contrast > least) & (difference[..., 0] > 0.0))
        yield from _long_components((contrast > least) & (difference[..., 0] < 0.0))
    for cluster in _color_clusters(lab):
        yield from _long_components(cluster)


def propose_by_color(
    lab: UInt8[np.ndarray, "h w 3"], color: Float64[np.ndarray, "3"]
) -> Iterator[UInt8[np.ndarray, "h w"]]:
    """Yield masks of long thin regions of a colour, strictest first.

    Args:
        lab: Image in Lab.
        color: Colour in Lab.
    """
    distance = color_distance(lab, color)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (STRIPE_LENGTH, STRIPE_LENGTH))
    for most in COLOR_DISTANCES:
        near = (distance < most).view(np.uint8)
        yield from _long_components(near)
        # Every second stripe of a striped or braided rope has the colour.
        yield from _long_components(cv2.morphologyEx(near, cv2.MORPH_CLOSE, kernel))


def color_distance(
    lab: UInt8[np.ndarray, "*k 3"], color: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "*k"]:
    """Return the distance of colours from a given one, differences of brightness reduced [Lab].

    Args:
        lab: Colours in Lab, as OpenCV scales it.
        color: Colour in Lab with which they are compared.
    """
    neutral = np.array([0.0, 128.0, 128.0])
    full, seen = color - neutral, lab - neutral
    shade = np.clip(seen @ full / max(float(full @ full), 1.0), *SHADE_RANGE)
    distance = np.linalg.norm(seen - shade[..., None] * full, axis=-1)
    return np.hypot(distance, DARKENING_DISTANCE * (1.0 - shade))


def _long_components(mask: np.ndarray) -> Iterator[UInt8[np.ndarray, "h w"]]:
    """Long thin components of a mask, longest first."""
    whole = mask.astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(whole, connectivity=8)
    longer = max(mask.shape)
    area = stats[:, cv2.CC_STAT_AREA]
    extent = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    likely = (extent > 0.5 * MIN_LENGTH * longer) & (area > MIN_LENGTH * longer)
    likely[0] = False
    if not np.any(likely):
        return
    # The mean distance from both sides of a strip is a quarter of its width.
    distance = cv2.distanceTransform(whole, cv2.DIST_L2, 3)
    total = np.bincount(labels.ravel(), distance.ravel(), minlength=count)
    width = np.maximum(4.0 * total / np.maximum(area, 1) - 1.0, MIN_WIDTH)
    length = area / width
    likely &= length > np.maximum(MIN_ASPECT * width, MIN_LENGTH * longer)
    found = np.flatnonzero(likely)
    for k in found[np.argsort(-length[found] / width[found] ** 0.5)][:MAX_PROPOSALS]:
        yield (labels == k).view(np.uint8)


def _color_clusters(lab: UInt8[np.ndarray, "h w 3"]) -> Iterator[np.ndarray]:
    """Masks of the colour clusters of an image."""
    scaled = lab.astype(np.float32) * np.array(CLUSTER_CHANNEL_WEIGHTS, np.float32)
    flat = scaled.reshape(-1, 3)
    sample = np.ascontiguousarray(flat[:: max(1, len(flat) // CLUSTER_SAMPLES)])
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 15, 0.5)
    cv2.setRNGSeed(0)
    _, _, centers = cv2.kmeans(sample, CLUSTER_COUNT, np.zeros(0), stop, 1, cv2.KMEANS_PP_CENTERS)
    distances = np.stack([np.sum((scaled - c) ** 2, axis=2) for c in centers])
    nearest = np.argmin(distances, axis=0)
    for k in range(len(centers)):
        yield nearest == k
