"""Labelled photographs for the training of the network, beside the rendered pictures.

Masks that people draw are off by up to a cable's width, and leave out the cables that only end in
the picture: neither is learnt from.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from benchmarks.perception.instances.bench import taken
from benchmarks.perception.network.pictures import UNLABELLED
from lariat.perception.image.network import rope_log_odds
from lariat.perception.image.width import usual_width

INNER_WIDTHS, OUTER_WIDTHS = 0.25, 0.6
"""Distances from the edge of a mask up to which it is not known what is a cable [widths]."""
SURE_LOG_ODDS = 2.0
"""Log odds from which a pixel without a mask may be a cable [-]."""
BORDER = 0.07
"""Width of the border in which only masks are known, as a share of the shorter side [-]."""
SEEN_SCALE = 1.7
"""Enlargement at which the network looks for cables without a mask [-]."""


def training_photographs(
    folder: Path,
) -> list[tuple[UInt8[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w"]]]:
    """Return every second photograph of a folder by name, the first included, and its mask.

    The others are for judging. The mask is 1 at cables, `UNLABELLED` where nobody knows, else 0.

    Args:
        folder: Folder as for `lariat bench perception instances --photographs`.
    """
    return [(color, known_mask(color, labels)) for _, color, labels in list(taken(folder))[::2]]


def known_mask(
    color: UInt8[np.ndarray, "h w 3"], labels: UInt8[np.ndarray, "h w"]
) -> UInt8[np.ndarray, "h w"]:
    """Return 1 at the labelled cables, 0 at the ground and `UNLABELLED` where either may be.

    Args:
        color: Red, green, blue.
        labels: 0 at the background, k at cable k.
    """
    mask = (labels > 0).view(np.uint8)
    width = usual_width(mask)
    inside, outside = (cv2.distanceTransform(m, cv2.DIST_L2, 5) for m in (mask, 1 - mask))
    at_edge = inside + outside < width * np.where(mask, INNER_WIDTHS, OUTER_WIDTHS)
    larger = cv2.resize(color, None, fx=SEEN_SCALE, fy=SEEN_SCALE, interpolation=cv2.INTER_CUBIC)
    odds = cv2.resize(rope_log_odds(np.asarray(larger, np.uint8)), mask.shape[::-1])
    seen = (odds > SURE_LOG_ODDS).view(np.uint8)
    border = np.ones(mask.shape, bool)
    rim = round(BORDER * min(mask.shape))
    border[rim:-rim, rim:-rim] = False
    # What is seen inside of the picture and touches no cable is a knot, a seam, a hole.
    _, pieces = cv2.connectedComponents(seen | mask)
    cables = np.setdiff1d(pieces[(mask > 0) | border], [0])
    without_mask = (mask == 0) & (border | np.isin(pieces, cables))
    # A cable that is seen beside its mask is where it is seen.
    moved = (odds < 0.0) & (cv2.distanceTransform(1 - seen, cv2.DIST_L2, 5) < width)
    unknown = at_edge | without_mask | ((mask > 0) & moved)
    return np.where(unknown, UNLABELLED, mask).astype(np.uint8)
