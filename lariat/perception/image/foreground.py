"""Foreground of an image: all pixels that show a rope, of whatever colour.

A network tells them; where it is unsure, the colours of what it sees for sure help.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8
from skimage.morphology import skeletonize

from lariat.perception.image.color_model import (
    color_distance,
    histogram_cells,
    log_likelihood_ratio,
    without_shadow,
)
from lariat.perception.image.network import rope_log_odds
from lariat.perception.image.width import usual_width, width_from_radii

MAX_PIXEL_COUNT = 500_000
"""Number of pixels to which a larger image is shrunk."""
FINE_SCALE, COARSE_SCALE = 1.55, 0.5
"""Scales at which the network sees the image [-]: its own finest scale is half of what it sees,
too coarse for real cables of 8 pixels."""
MAX_HOLE_AREA = 0.8
"""Area up to which a hole in the foreground is filled [squared rope widths]."""
MAX_GROUND_SHARE = 0.3
"""Share of a hole that surely shows no rope from which it is not filled [-]."""
MIN_PIECE_LENGTH = 0.04
"""Least extent of a piece, as a share of the image's longer side."""
MIN_PIECE_WIDTHS = 2.0
"""The same in rope widths."""
MAX_PIECE_COUNT = 80
"""Number of pieces that are kept, the longest: grain and print have hundreds."""
ADDED_LOG_ODDS = 1.0
"""Addition to the network's log odds [-]: on real grounds it sees less than there is."""
MAX_LOG_ODDS = 4.0
"""Limit of the log odds [-]."""
PERHAPS_LOG_ODDS = -2.0
"""Log odds above which a pixel is no example of the background [-]."""
COLOR_WEIGHT = 2.0
"""Weight of the log likelihood ratio of colours beside the log odds [-]."""
SAME_COLOR_DISTANCE, COLOR_DISTANCE_SCALE = 20.0, 5.0
"""Distance from a given colour at which a pixel has it as likely as not, and that which changes the
log odds by one [Lab]."""
EDGE_LOG_ODDS = 0.5
"""Mean of both at the edge of a rope [-]: pixels beside it have its colours, mixed with others."""


@dataclass(frozen=True)
class Foreground:
    """All ropes of an image, in the resolution in which they are measured."""

    image: UInt8[np.ndarray, "h w 3"]
    """Red, green, blue."""
    lab: UInt8[np.ndarray, "h w 3"]
    """The same in Lab, as OpenCV scales it."""
    mask: UInt8[np.ndarray, "h w"]
    """1 at pixels of ropes."""
    skeleton: Bool[np.ndarray, "h w"]
    """Skeleton of the mask."""
    width: float
    """Width of most of the ropes [pixels]."""
    radii: Float32[np.ndarray, "h w"]
    """Distance of every pixel of the mask from its outside [pixels]."""
    log_odds: Float32[np.ndarray, "h w"]
    """Log odds that a pixel shows a rope, as the network tells, limited to `MAX_LOG_ODDS`."""
    likelihood: Float32[np.ndarray, "h w"]
    """The same with the evidence of colours; zero at the edge of the mask."""
    evidence: Float32[np.ndarray, "h w"]
    """The same on which a rope's edge is measured; zero at the edge of a rope."""
    ground: UInt8[np.ndarray, "h w"]
    """1 where surely no rope is seen."""
    left_out: int
    """Number of shorter pieces that were left out."""


def find_foregrounds(
    color: UInt8[np.ndarray, "h w 3"], wanted: Float64[np.ndarray, "3"] | None = None
) -> list[Foreground]:
    """Return the foreground of an image, and those with what else may be rope added.

    That is what the network sees of it at half its size alone, and what has a given colour. There
    is none where nothing in the image is long.

    Args:
        color: Red, green, blue.
        wanted: Colour of the ropes in Lab; None: any.
    """
    scale = min(1.0, (MAX_PIXEL_COUNT / (color.shape[0] * color.shape[1])) ** 0.5)
    size = tuple(max(1, round(scale * n)) for n in color.shape[1::-1])
    image = color if scale == 1.0 else cv2.resize(color, size, interpolation=cv2.INTER_AREA)
    image = np.asarray(image, np.uint8)
    lab = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2LAB), np.uint8)
    every = [_seen(color, size, FINE_SCALE)]
    # The network takes thick ropes without light and shade for print, but not at half their size.
    coarse = _seen(color, size, COARSE_SCALE)
    unseen = (coarse > MAX_LOG_ODDS) & (every[0] < PERHAPS_LOG_ODDS)
    if np.any(_long_pieces(unseen.view(np.uint8), 0.0)[0]):
        every.append(np.maximum(every[0], coarse))
    if wanted is not None:
        told = (SAME_COLOR_DISTANCE - color_distance(lab, wanted)) / COLOR_DISTANCE_SCALE
        every.append(np.maximum(every[0], told))
    limited = [np.clip(odds, -MAX_LOG_ODDS, MAX_LOG_ODDS).astype(np.float32) for odds in every]
    found = [_foreground(image, lab, odds) for odds in limited]
    return [f for f in found if f is not None]


def _seen(
    color: UInt8[np.ndarray, "i j 3"], size: tuple[int, ...], scale: float
) -> Float32[np.ndarray, "h w"]:
    """Log odds of an image of a size (w, h) that the network sees at a scale of it."""
    inside = tuple(max(1, round(scale * n)) for n in size)
    shrinks = inside[0] < color.shape[1]
    blend = cv2.INTER_AREA if shrinks else cv2.INTER_CUBIC
    odds = rope_log_odds(np.asarray(cv2.resize(color, inside, interpolation=blend), np.uint8))
    return np.asarray(cv2.resize(odds, size), np.float32) + ADDED_LOG_ODDS


def _foreground(
    image: UInt8[np.ndarray, "h w 3"],
    lab: UInt8[np.ndarray, "h w 3"],
    log_odds: Float32[np.ndarray, "h w"],
) -> Foreground | None:
    mask = (log_odds > 0.0).view(np.uint8)
    if not np.any(mask):
        return None
    width = usual_width(mask)
    mask, _ = _long_pieces(mask, width)
    if not np.any(mask):
        return None
    perhaps = np.maximum(mask, (log_odds > PERHAPS_LOG_ODDS).view(np.uint8))
    # The network takes part of a shadow for the rope that throws it.
    lit = without_shadow(lab, mask, width)
    ratio = log_likelihood_ratio(histogram_cells(lab), lit if np.any(lit) else mask, perhaps, width)
    likelihood = log_odds + COLOR_WEIGHT * ratio
    mask, left_out = _long_pieces((likelihood > 0.0).view(np.uint8), width)
    ground = (log_odds < PERHAPS_LOG_ODDS).view(np.uint8)
    mask = _without_holes(mask, ground, width)
    skeleton = _skeleton_to_border(mask, width)
    if not np.any(skeleton):
        return None
    radii = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    # What colours add makes the mask whole, but also wider.
    evidence = log_odds + 0.5 * COLOR_WEIGHT * ratio - EDGE_LOG_ODDS
    width = width_from_radii(radii[skeleton])
    return Foreground(
        image,
        lab,
        mask,
        skeleton,
        width,
        radii,
        log_odds,
        likelihood,
        evidence,
        ground,
        left_out,
    )


def _long_pieces(
    mask: UInt8[np.ndarray, "h w"], width: float
) -> tuple[UInt8[np.ndarray, "h w"], int]:
    """Longest pieces of a mask, and the number of others that are long enough."""
    least = max(MIN_PIECE_LENGTH * max(mask.shape), MIN_PIECE_WIDTHS * width)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    extent = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    extent[0] = 0.0
    enough = np.flatnonzero(extent > least)
    chosen = enough[np.argsort(-extent[enough], kind="stable")][:MAX_PIECE_COUNT]
    kept = np.zeros(len(stats), np.uint8)
    kept[chosen] = 1
    return kept[labels], len(enough) - len(chosen)


def _skeleton_to_border(mask: UInt8[np.ndarray, "h w"], width: float) -> Bool[np.ndarray, "h w"]:
    """Skeleton of a mask that goes on beyond the image for half a width: no forks at its border."""
    beyond = int(np.ceil(0.5 * width))
    wider = cv2.copyMakeBorder(mask, *[beyond] * 4, cv2.BORDER_REPLICATE)
    return skeletonize(wider.view(bool))[beyond:-beyond, beyond:-beyond].copy()


def _without_holes(
    mask: UInt8[np.ndarray, "h w"], ground: UInt8[np.ndarray, "h w"], width: float
) -> UInt8[np.ndarray, "h w"]:
    """Mask whose small holes are filled: highlights that have the colour of the ground."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(1 - mask, connectivity=4)
    area = stats[:, cv2.CC_STAT_AREA]
    surely = np.bincount(labels[ground > 0], minlength=count)
    # Between two ropes that cross at a small angle lies a narrow piece of ground.
    small = (area < MAX_HOLE_AREA * width**2) & (surely < MAX_GROUND_SHARE * area)
    small[0] = False
    return mask | small[labels].view(np.uint8)
