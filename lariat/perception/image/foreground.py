"""Foreground of an image: all pixels that show a rope, of whatever colour.

A network tells them; where its answer is doubtful, so do contrast and colour. Each way is measured
in an image of sufficient resolution, and each is judged by what the network sees.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8
from skimage.morphology import skeletonize

from lariat.perception.centerline.segmentation import Color
from lariat.perception.image.color_model import (
    ROPE_LOG_RATIO,
    histogram_cells,
    log_likelihood_ratio,
    without_shadow,
    without_wide_regions,
)
from lariat.perception.image.contrast import RopeMask
from lariat.perception.image.ground import stand_out
from lariat.perception.image.kinds import (
    Kind,
    kinds_anywhere,
    kinds_on_ground,
    long_enough,
    usual_width,
)
from lariat.perception.image.network import rope_log_odds
from lariat.perception.image.width import width_from_radii

SEARCH_SIDE = 480
"""Longer side of the image in which contrast and colours are searched for ropes [pixels]."""
MEASUREMENT_SIDE = 1000
"""Longer side of the image in which ropes are measured, if they are wide enough there [pixels]."""
MEASUREMENT_WIDTH = 6.0
"""Width of a rope that is sufficient for its measurement [pixels]."""
MAX_HOLE_AREA = 0.8
"""Area up to which a hole in the foreground is filled [squared rope widths]."""
MAX_GROUND_SHARE = 0.3
"""Share of a hole that surely shows no rope from which it is not filled [-]."""
MIN_PIECE_LENGTH = 0.04
"""Least extent of a piece that the network finds, as a share of the image's longer side."""
MIN_PIECE_WIDTHS = 2.0
"""The same in rope widths."""
MAX_LOG_ODDS = 4.0
"""Limit of the network's log odds [-]."""
PERHAPS_LOG_ODDS = -2.0
"""Log odds of the network above which a pixel is no example of the background [-]."""
COLOR_WEIGHT = 2.0
"""Weight of the log likelihood ratio of colours beside the network's log odds [-]."""
EDGE_LOG_ODDS = 0.5
"""Mean of both at the edge of a rope [-]: pixels beside it have its colours, mixed with others."""


@dataclass(frozen=True)
class Foreground:
    """All ropes of an image, in the resolution in which they are measured."""

    image: UInt8[np.ndarray, "h w 3"]
    """Red, green, blue."""
    lab: UInt8[np.ndarray, "h w 3"]
    """The same in Lab, as OpenCV scales it."""
    rope: RopeMask
    """Mask of all ropes."""
    radii: Float32[np.ndarray, "h w"]
    """Distance of every pixel of the mask from its outside [pixels]."""
    log_odds: Float32[np.ndarray, "h w"]
    """The network's log odds of every pixel, limited to `MAX_LOG_ODDS`."""
    evidence: Float32[np.ndarray, "h w"]
    """Log odds that a pixel shows a rope, on which its edge is measured; zero at the edge."""
    ground: UInt8[np.ndarray, "h w"]
    """1 where surely no rope is seen, as the network tells; 0 everywhere in other ways."""
    by_color: bool
    """Whether it is what has the colours of proposals, whatever the ground is."""


def find_foregrounds(
    color: UInt8[np.ndarray, "h w 3"], rope_color: Color | None = None
) -> Iterator[Foreground]:
    """Yield foregrounds of an image, the most likely way of finding one first.

    What the network sees comes first, then what stands out from the ground, then what has the
    colours of proposals. With a colour, everything is still foreground at first: other ropes are
    then bridged, not followed.

    Args:
        color: Red, green, blue.
        rope_color: Colour of the ropes; None: any.
    """
    image = _shrunk(color, MEASUREMENT_SIDE)
    log_odds = np.clip(rope_log_odds(image), -MAX_LOG_ODDS, MAX_LOG_ODDS)
    found = _seen(image, log_odds)
    if found is not None:
        yield found
    lab = _to_lab(_shrunk(color, SEARCH_SIDE))
    out = stand_out(lab)
    found = None if out is None else _measured(color, lab, kinds_on_ground(lab, out), log_odds)
    if found is not None:
        yield found
    for wanted in (None,) if rope_color is None else (None, _lab_of(rope_color)):
        kinds = kinds_anywhere(lab, wanted)
        found = _measured(color, lab, kinds, log_odds, by_color=True)
        if found is not None:
            yield found


def _seen(
    image: UInt8[np.ndarray, "h w 3"], log_odds: Float32[np.ndarray, "h w"]
) -> Foreground | None:
    """What the network sees, where it is unsure with the help of colours; None if nothing long."""
    mask = (log_odds > 0.0).view(np.uint8)
    if not np.any(mask):
        return None
    width = usual_width(mask)
    mask = _long_pieces(mask, width)
    if not np.any(mask):
        return None
    perhaps = np.maximum(mask, (log_odds > PERHAPS_LOG_ODDS).view(np.uint8))
    lab = _to_lab(image)
    # The network takes part of a shadow for the rope that throws it.
    lit = without_shadow(lab, mask, width)
    ratio = log_likelihood_ratio(histogram_cells(lab), lit if np.any(lit) else mask, perhaps, width)
    likelihood = log_odds + COLOR_WEIGHT * ratio
    mask = _long_pieces((likelihood > 0.0).view(np.uint8), width)
    # What colours add makes the mask whole, but also wider.
    evidence = log_odds + 0.5 * COLOR_WEIGHT * ratio - EDGE_LOG_ODDS
    ground = (log_odds < PERHAPS_LOG_ODDS).view(np.uint8)
    return _foreground(image, likelihood + ROPE_LOG_RATIO, mask, width, log_odds, evidence, ground)


def _long_pieces(mask: UInt8[np.ndarray, "h w"], width: float) -> UInt8[np.ndarray, "h w"]:
    return long_enough(mask, max(MIN_PIECE_LENGTH * max(mask.shape), MIN_PIECE_WIDTHS * width))


def _measured(
    color: UInt8[np.ndarray, "h w 3"],
    small: UInt8[np.ndarray, "i j 3"],
    kinds: list[Kind],
    log_odds: Float32[np.ndarray, "k l"],
    by_color: bool = False,
) -> Foreground | None:
    """Foreground of an image, with the colours of kinds found in a smaller one."""
    if not kinds:
        return None
    longer = max(color.shape[:2])
    narrowest = min(k.rope.width for k in kinds) * longer / max(small.shape[:2])
    enough = round(longer * min(1.0, MEASUREMENT_WIDTH / narrowest))
    image = _shrunk(color, max(MEASUREMENT_SIDE, enough))
    size = (image.shape[1], image.shape[0])
    scale = size[0] / small.shape[1]
    cells = histogram_cells(_to_lab(image))
    pieces = [cv2.resize(k.rope.mask, size, interpolation=cv2.INTER_NEAREST) for k in kinds]
    every = np.bitwise_or.reduce(pieces)
    likelihood = np.full(every.shape, -np.inf, np.float32)
    mask = np.zeros_like(every)
    for kind, piece in zip(kinds, pieces, strict=True):
        width = kind.rope.width * scale
        own = log_likelihood_ratio(cells, piece, every, width)
        likelihood = np.maximum(likelihood, own)
        mask |= without_wide_regions((own > ROPE_LOG_RATIO).view(np.uint8), width)
    # A pixel of a component that no kind has touched is of a colour by chance.
    count, labels = cv2.connectedComponents(mask, connectivity=8)
    touched = np.bincount(labels[every > 0], minlength=count)
    area = np.bincount(labels.ravel(), minlength=count)
    kept = touched > 0.3 * area
    kept[0] = False
    width = min(k.rope.width for k in kinds) * scale
    seen = cv2.resize(log_odds, size, interpolation=cv2.INTER_LINEAR)
    mask = kept[labels].view(np.uint8)
    evidence = likelihood - ROPE_LOG_RATIO
    ground = np.zeros_like(mask)
    return _foreground(image, likelihood, mask, width, seen, evidence, ground, by_color)


def _foreground(
    image: UInt8[np.ndarray, "h w 3"],
    likelihood: Float32[np.ndarray, "h w"],
    mask: UInt8[np.ndarray, "h w"],
    width: float,
    log_odds: Float32[np.ndarray, "h w"],
    evidence: Float32[np.ndarray, "h w"],
    ground: UInt8[np.ndarray, "h w"],
    by_color: bool = False,
) -> Foreground | None:
    if not np.any(mask):
        return None
    mask = _without_holes(mask, ground, width)
    radii = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    skeleton = _skeleton_to_border(mask, width)
    if not np.any(skeleton):
        return None
    rope = RopeMask(likelihood, mask, skeleton, width_from_radii(radii[skeleton]))
    return Foreground(image, _to_lab(image), rope, radii, log_odds, evidence, ground, by_color)


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


def _shrunk(color: UInt8[np.ndarray, "h w 3"], longer: int) -> UInt8[np.ndarray, "h w 3"]:
    """Image with at most a given longer side [pixels]."""
    scale = min(1.0, longer / max(color.shape[:2]))
    if scale == 1.0:
        return color
    return cv2.resize(color, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)


def _to_lab(color: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    return cv2.cvtColor(color, cv2.COLOR_RGB2LAB)


def _lab_of(color: Color) -> Float64[np.ndarray, "3"]:
    return _to_lab(np.array([[color]], np.uint8))[0, 0].astype(float)
