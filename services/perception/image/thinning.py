"""Thinning of a mask to lines of one pixel.

After Zhang and Suen, A fast parallel algorithm for thinning digital patterns, Communications of the
ACM 27 (1984): each pass removes pixels at the border, first those towards one corner of the image,
then those towards the other, until none is left whose removal keeps all connections. The table of
removable pixels is that of scikit-image (Copyright 2009-2022 the scikit-image team, BSD-3-Clause);
the skeletons are equal to its own, without its import of half a second.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

NEIGHBORS = ((-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1))
"""Row and column of the neighbours of a pixel, clockwise; bit k of a pattern is neighbour k."""
_TABLE = (
    "0001001300311013000000002020303300000000300000000000000020003022"
    "0000000000000000000000000000000020000000200020003000000030003020"
    "0031001300000001000000000000000131000000000000002000000000000000"
    "2313001300000001000000000000000023010001000000003301000022002000"
)
"""For each pattern: 1 if the first half of a pass removes the pixel, 2 the second, 3 either."""
REMOVABLE = tuple(np.array([int(digit) & half != 0 for digit in _TABLE]) for half in (1, 2))
"""Whether a pixel is removed, for each half of a pass and each pattern."""


def skeletonize(mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Return the skeleton of a mask."""
    padded = np.pad(mask.view(np.uint8), 1)
    values = padded.ravel()
    offsets = [row * padded.shape[1] + column for row, column in NEIGHBORS]
    pixels, before = np.flatnonzero(values), -1
    while before != len(pixels):
        before = len(pixels)
        for removable in REMOVABLE:
            patterns = values[pixels + offsets[0]]
            for bit, offset in enumerate(offsets[1:], start=1):
                patterns |= values[pixels + offset] << bit
            removed = removable[patterns]
            values[pixels[removed]] = 0
            pixels = pixels[~removed]
    return padded[1:-1, 1:-1].view(bool).copy()
