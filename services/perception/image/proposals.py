"""Where in a picture something long and thin stands out: guesses that a ribbon is learnt from."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from services.perception.image.color_model import measured

AROUND = (0.04, 0.1, 0.25)
"""Widths of what a pixel is compared with, as parts of the picture: a rope is below half."""
LEAST_CONTRAST = 10.0
"""Distance in Lab from there, as OpenCV scales it, that stands out."""
SHADES = 9
"""Kinds of colour that a picture is divided into."""
THIN = 6.0
"""Length over width from which on a piece is long and thin."""
LEAST_LENGTH = 0.12
"""Of a piece, as a part of the picture's longer side."""
NEAR = (8.0, 14.0, 22.0, 34.0)
"""Distances in Lab up to which a pixel has a given colour."""
SHADES_OF, DIMMING = (0.4, 1.2), 45.0
"""How dark and bright a given colour is seen, and the distance that full darkness counts for."""
STRIPES = 11
"""Gaps between pieces of that colour that are closed [pixels]."""
MOST = 5
"""Pieces of one division that are looked at."""


def pieces(lab: UInt8[np.ndarray, "h w 3"]) -> Iterator[UInt8[np.ndarray, "h w"]]:
    """Masks of long and thin pieces, by contrast to their surroundings and by colour.

    Args:
        lab: The picture in Lab, a few hundred pixels wide.
    """
    longer = max(lab.shape[:2])
    for part in AROUND:
        # What is thinner than half the window does not show in its median: light and table do.
        around = cv2.medianBlur(lab, 2 * int(part * longer / 2.0) + 1)
        gap = lab.astype(np.float32) - around
        out = np.minimum(np.linalg.norm(gap, axis=2), 255.0).astype(np.uint8)
        least = max(LEAST_CONTRAST, float(cv2.threshold(out, 0, 255, cv2.THRESH_OTSU)[0]))
        yield from _long(out > least)
        yield from _long((out > least) & (gap[..., 0] > 0.0))
        yield from _long((out > least) & (gap[..., 0] < 0.0))
    for shade in _shades(lab):
        yield from _long(shade)


def pieces_of(
    lab: UInt8[np.ndarray, "h w 3"], color: Float64[np.ndarray, "3"]
) -> Iterator[UInt8[np.ndarray, "h w"]]:
    """Masks of long and thin pieces of a colour in Lab, the strictest first."""
    away = unlike(lab, color)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (STRIPES, STRIPES))
    for most in NEAR:
        near = (away < most).view(np.uint8)
        yield from _long(near)
        # Of a striped or braided rope every second piece has the colour.
        yield from _long(cv2.morphologyEx(near, cv2.MORPH_CLOSE, kernel))


def unlike(
    lab: UInt8[np.ndarray, "*k 3"], color: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "*k"]:
    """Distance in Lab of colours from a given one, less where light explains it."""
    neutral = np.array([0.0, 128.0, 128.0])
    full, seen = color - neutral, lab - neutral
    shade = np.clip(seen @ full / max(float(full @ full), 1.0), *SHADES_OF)
    away = np.linalg.norm(seen - shade[..., None] * full, axis=-1)
    return np.hypot(away, DIMMING * (1.0 - shade))


def _long(mask: np.ndarray) -> Iterator[UInt8[np.ndarray, "h w"]]:
    """Long thin components, the longest first."""
    whole = mask.astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(whole, connectivity=8)
    longer = max(mask.shape)
    extent = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    likely = [k for k in range(1, count) if extent[k] > 0.5 * LEAST_LENGTH * longer]
    found = []
    for k in sorted(likely, key=lambda k: -extent[k])[: 2 * MOST]:
        x, y, w, h = stats[k, :4]
        part = (labels[y : y + h, x : x + w] == k).view(np.uint8)
        width, middle = measured(np.pad(part, 1))
        length = int(np.count_nonzero(middle))
        if length > max(THIN * width, LEAST_LENGTH * longer):
            found.append((length / width**0.5, k))
    for _, k in sorted(found, reverse=True)[:MOST]:
        yield (labels == k).view(np.uint8)


def _shades(lab: UInt8[np.ndarray, "h w 3"]) -> Iterator[np.ndarray]:
    """The picture divided by colour."""
    scaled = lab.astype(np.float32) * np.array([0.6, 1.3, 1.3], np.float32)
    flat = scaled.reshape(-1, 3)
    sample = np.ascontiguousarray(flat[:: max(1, len(flat) // 6000)])
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 15, 0.5)
    cv2.setRNGSeed(0)
    _, _, centers = cv2.kmeans(sample, SHADES, np.zeros(0), stop, 1, cv2.KMEANS_PP_CENTERS)
    away = np.stack([np.sum((scaled - c) ** 2, axis=2) for c in centers])
    nearest = np.argmin(away, axis=0)
    for k in range(len(centers)):
        yield nearest == k
