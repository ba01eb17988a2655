"""Centre lines in one picture, whatever took it: no camera, no cell, no rope model.

The rope's colour is given, or found: that of the long and thin piece that stands out most from
what lies around it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8, UInt16
from skimage.morphology import skeletonize

from services.perception.ridge import Ridge, ridge
from services.perception.segmentation import Color, ColorLikeness, Region, rope_region
from services.perception.skeleton import strands

SMALL = 400
"""Longer side of the picture in which a colour is sought [pixels]."""
AROUND = 61
"""Width of what a pixel is compared with there [pixels]: a rope is less than half as wide."""
LEAST_CONTRAST = 14.0
"""Distance in Lab from there, as OpenCV scales it, that stands out."""
THIN = 8.0
"""Length over width from which on a piece is long and thin."""
LEAST_PIECE = 60
"""Pixels of the small picture; what is smaller is noise."""
SHARE = 0.012
"""Part of the picture that a rope of a given colour is taken to cover."""


@dataclass(frozen=True)
class Photograph:
    """A picture and the rope in it."""

    region: Region
    """The part of it that holds everything that looks like rope."""
    width: float
    """Of the rope [pixels]."""
    lines: list[Ridge]
    """Sub-pixel centre lines, longest first."""


def read(
    color: UInt8[np.ndarray, "h w 3"],
    rope_color: Color | None = None,
    depth: UInt16[np.ndarray, "h w"] | None = None,
    threshold: int = 128,
) -> Photograph:
    """The centre lines of everything in a picture that has the rope's colour.

    Args:
        color: Red, green, blue.
        rope_color: Of the rope; None: found in the picture.
        depth: Of the same pixels [mm], 0 where nothing was measured.
        threshold: Least likeness to the colour, 1..254.

    Raises:
        ValueError: Nothing in the picture looks like rope.
    """
    share = SHARE
    if rope_color is None:
        rope_color, share = found_color(color)
    region = rope_region(ColorLikeness(rope_color)(color, share), threshold)
    if region is None:
        raise ValueError(
            f"no pixel looks like the rope's colour {list(rope_color)}; take a colour from the "
            "picture itself"
        )
    width = _width(region.mask)
    if depth is None:
        depth = np.zeros(color.shape[:2], np.uint16)
    lines = [ridge(s, region, depth, width) for s in strands(region.mask, width)]
    # Shorter than three widths a piece has no direction that would make it rope.
    long = [line for line in lines if len(line.pixels) > 3.0 * width]
    return Photograph(region, width, long)


def found_color(color: UInt8[np.ndarray, "h w 3"]) -> tuple[Color, float]:
    """The colour of the long and thin piece that stands out most from what lies around it.

    Returns:
        The colour, and the part of the picture that the piece covers.

    Raises:
        ValueError: Nothing does.
    """
    scale = min(1.0, SMALL / max(color.shape[:2]))
    small = cv2.resize(color, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    lab = cv2.cvtColor(small, cv2.COLOR_RGB2LAB)
    # What is thinner than half the window does not show in its median: light and table do.
    around = cv2.medianBlur(lab, AROUND)
    out = np.linalg.norm(lab.astype(np.float32) - around, axis=2)
    out = np.minimum(out, 255.0).astype(np.uint8)
    least = max(LEAST_CONTRAST, cv2.threshold(out, 0, 255, cv2.THRESH_OTSU)[0])
    mask = (out > least).view(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    away = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    middle = skeletonize(mask.view(bool))
    best, chosen, share = 0.0, None, 0.0
    for k in range(1, count):
        line = middle & (labels == k)
        half = away[line]
        if stats[k, cv2.CC_STAT_AREA] < LEAST_PIECE or len(half) < THIN * 2.0 * np.mean(half):
            continue
        worth = len(half) * float(np.mean(out[line]))
        if worth > best:
            best, chosen = worth, small[line & (away >= np.median(half))]
            share = stats[k, cv2.CC_STAT_AREA] / mask.size
    if chosen is None:
        raise ValueError(
            "nothing in the picture is long, thin and of one colour; give the rope's colour"
        )
    red, green, blue = np.median(chosen, axis=0)
    return (int(red), int(green), int(blue)), float(share)


def _width(mask: UInt8[np.ndarray, "h w"]) -> float:
    """Of what is long and thin in a mask [pixels]."""
    away = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    # The distance reaches to the middle of the first pixel outside.
    half: Float64[np.ndarray, "k"] = away[skeletonize(mask.view(bool))].astype(float)
    return max(2.0 * float(np.median(half)) - 1.0, 1.5)
