"""Colour model of the ropes in an image, learnt from what the network sees of them.

The colours of ropes and surroundings make two histograms; the logarithm of their ratio is the log
likelihood ratio of rope at every pixel. Highlights, dark flanks and stripes are learnt as further
colours.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8
from scipy.ndimage import gaussian_filter

from lariat.perception.image.contrast import could_be_shadow
from lariat.perception.image.width import ridge

HISTOGRAM_BITS = (5, 6, 6)
"""Bits of lightness and both chromas that the histograms distinguish."""
HISTOGRAM_SIGMA = (0.8, 1.6, 1.6)
"""Standard deviation of the histograms' smoothing: light and noise beyond the piece [cells]."""
MIN_DENSITY = 2e-6
"""Density that is added to both histograms, so that unseen colours have a ratio of one [-]."""
MAX_LOG_RATIO = 4.0
"""Limit of the log likelihood ratio, so that no pixel dominates its neighbours [-]."""
NEAR_WEIGHT, FAR_WEIGHT = 0.6, 0.4
"""Weights of the colours beside the piece, and of all others, in the background's histogram."""
FAR_PIXEL_STRIDE = 7
"""Stride of the pixels far from the piece that enter the histogram [pixels]."""
SHADE_RANGE = (0.4, 1.2)
"""Darkest and brightest shade of a given colour."""
DARKENING_DISTANCE = 45.0
"""Distance between a colour and its shade of brightness zero [Lab]."""
LIT_SHARE = 0.95
"""Lightness relative to the mean around it from which ground lies in the light [-]."""
SHADOW_MAJORITY = 0.5
"""Dark share of a component's skeleton above which it is a dark rope, not one with a shadow."""


def without_shadow(
    lab: UInt8[np.ndarray, "h w 3"], mask: UInt8[np.ndarray, "h w"], width: float
) -> UInt8[np.ndarray, "h w"]:
    """Return a mask without the shadows along its components; one that is all shadow stays.

    Args:
        lab: Image in Lab, as OpenCV scales it.
        mask: 1 at pixels of ropes.
        width: Width of the ropes [pixels].
    """
    step = max(1, int(width / 3.0))
    table = _lit_ground(lab, mask, width, step)
    rows, columns = np.nonzero(mask)
    at = (
        np.minimum(rows // step, table.shape[0] - 1),
        np.minimum(columns // step, table.shape[1] - 1),
    )
    dark = could_be_shadow(lab[rows, columns].astype(float), table[at].astype(float))
    count, labels = cv2.connectedComponents(mask, connectivity=8)
    component = labels[rows, columns]
    inner = ridge(cv2.distanceTransform(mask, cv2.DIST_L2, 5))[rows, columns]
    total = np.bincount(component[inner], minlength=count)
    dark_count = np.bincount(component[inner], dark[inner], minlength=count)
    dark &= ~(dark_count > SHADOW_MAJORITY * total)[component]
    if not np.any(dark):
        return mask
    core = mask.copy()
    core[rows[dark], columns[dark]] = 0
    # A highlight on a dark rope is as grey as a shadow, but has rope on both sides.
    reach = 2 * max(1, round(0.3 * width)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    return cv2.morphologyEx(core, cv2.MORPH_CLOSE, kernel) * mask


def _lit_ground(
    lab: UInt8[np.ndarray, "h w 3"], mask: UInt8[np.ndarray, "h w"], width: float, step: int
) -> Float32[np.ndarray, "i j 3"]:
    """Colours of the ground near a mask where it lies in the light, in cells of `step` pixels."""
    small = cv2.resize(lab, None, fx=1.0 / step, fy=1.0 / step, interpolation=cv2.INTER_AREA)
    outside = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5) > 0.8 * width + 1.0
    size = (small.shape[1], small.shape[0])
    free = cv2.resize(outside.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    sigma = 2.0 * width / step

    def table() -> Float32[np.ndarray, "i j 3"]:
        total = cv2.GaussianBlur(small.astype(np.float32) * free[..., None], (0, 0), sigma)
        return total / np.maximum(cv2.GaussianBlur(free, (0, 0), sigma), 1e-3)[..., None]

    free = free * (small[..., 0] > LIT_SHARE * table()[..., 0])
    return table()


def histogram_cells(lab: UInt8[np.ndarray, "h w 3"]) -> np.ndarray:
    """Return the histogram cell of every pixel.

    Args:
        lab: Image in Lab, as OpenCV scales it.
    """
    bits = HISTOGRAM_BITS
    cells = (lab[..., 0] >> (8 - bits[0])).astype(np.int32) << (bits[1] + bits[2])
    # The chroma of photographs lies in the middle half of its scale.
    a, b = (np.clip(lab[..., k].astype(np.int32) - 64, 0, 127) for k in (1, 2))
    return cells | (a >> (7 - bits[1])) << bits[2] | (b >> (7 - bits[2]))


def log_likelihood_ratio(
    cells: np.ndarray, mask: UInt8[np.ndarray, "h w"], ropes: UInt8[np.ndarray, "h w"], width: float
) -> Float32[np.ndarray, "h w"]:
    """Return the smoothed log likelihood ratio of rope against background for every pixel.

    Args:
        cells: Histogram cell of every pixel.
        mask: 1 at pixels of the rope.
        ropes: 1 at pixels of any rope, which are no background.
        width: Width of the rope [pixels].
    """
    outer, inner = 2.5 * width + 3.0, 0.3 * width + 1.0
    distance = cv2.distanceTransform(1 - ropes, cv2.DIST_L2, 5)
    near = (distance > inner) & (distance < outer)
    far = distance >= outer
    rope = _density(cells[mask > 0])
    # The rope must differ from what lies beside it, and from the rest of the image.
    background = NEAR_WEIGHT * _density(cells[near]) + FAR_WEIGHT * _density(
        cells[far][::FAR_PIXEL_STRIDE]
    )
    ratio = np.log((rope + MIN_DENSITY) / (background + MIN_DENSITY))
    ratio = np.clip(ratio, -MAX_LOG_RATIO, MAX_LOG_RATIO).astype(np.float32).ravel()
    return cv2.GaussianBlur(ratio[cells], (0, 0), max(0.6, 0.14 * width))


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


def _density(cells: np.ndarray) -> np.ndarray:
    """Smoothed histogram of cells, normalised to one."""
    count = np.bincount(cells, minlength=1 << sum(HISTOGRAM_BITS)).astype(np.float32)
    shape = tuple(1 << b for b in HISTOGRAM_BITS)
    return gaussian_filter(count.reshape(shape), HISTOGRAM_SIGMA) / max(len(cells), 1)
