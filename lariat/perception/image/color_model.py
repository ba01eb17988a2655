"""Colour model of a rope in an image, learnt from one piece of it.

The colours of the piece and of its surroundings make two histograms; the logarithm of their ratio
is the log likelihood ratio of rope at every pixel. Highlights, dark flanks and stripes are learnt
as further colours. Components much wider, thinner or shorter than the piece are dropped.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8
from scipy.ndimage import gaussian_filter
from skimage.morphology import skeletonize

from lariat.perception.image.contrast import RopeMask, could_be_shadow
from lariat.perception.image.width import measure_width, ridge, width_from_radii

HISTOGRAM_BITS = (5, 6, 6)
"""Bits of lightness and both chromas that the histograms distinguish."""
HISTOGRAM_SIGMA = (0.8, 1.6, 1.6)
"""Standard deviation of the histograms' smoothing: light and noise beyond the piece [cells]."""
MIN_DENSITY = 2e-6
"""Density that is added to both histograms, so that unseen colours have a ratio of one [-]."""
MAX_LOG_RATIO = 4.0
"""Limit of the log likelihood ratio, so that no pixel dominates its neighbours [-]."""
ROPE_LOG_RATIO = 0.8
"""Log likelihood ratio above which a pixel is rope; positive, since background is more frequent."""
NEAR_WEIGHT, FAR_WEIGHT = 0.6, 0.4
"""Weights of the colours beside the piece, and of all others, in the background's histogram."""
FAR_PIXEL_STRIDE = 7
"""Stride of the pixels far from the piece that enter the histogram [pixels]."""
MAX_RADIUS_WIDTHS = 1.35
"""Half width above which a region is not rope [rope widths]."""
MIN_WIDTH_RATIO = 0.45
"""Width below which a component is not rope [rope widths]."""
MIN_LENGTH_WIDTHS = 4.0
"""Length below which a component is dropped [rope widths]."""
LIT_SHARE = 0.95
"""Lightness relative to the mean around it from which ground lies in the light [-]."""
SHADOW_MAJORITY = 0.5
"""Dark share of a component's skeleton above which it is a dark rope, not one with a shadow."""


def learn_rope_mask(
    lab: UInt8[np.ndarray, "h w 3"], piece: UInt8[np.ndarray, "h w"]
) -> RopeMask | None:
    """Return all rope-like pixels with the colours of a piece; None when there are none.

    Args:
        lab: Image in Lab, as OpenCV scales it.
        piece: 1 at the pixels of a piece of rope.
    """
    width, _ = measure_width(piece)
    mask = without_shadow(lab, piece, width)
    likelihood = log_likelihood_ratio(histogram_cells(lab), mask, mask, width)
    mask, skeleton, radii = _rope_like((likelihood > ROPE_LOG_RATIO).view(np.uint8), width)
    if not np.any(skeleton):
        return None
    return RopeMask(likelihood, mask, skeleton, width_from_radii(radii[skeleton]))


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


def _density(cells: np.ndarray) -> np.ndarray:
    """Smoothed histogram of cells, normalised to one."""
    count = np.bincount(cells, minlength=1 << sum(HISTOGRAM_BITS)).astype(np.float32)
    shape = tuple(1 << b for b in HISTOGRAM_BITS)
    return gaussian_filter(count.reshape(shape), HISTOGRAM_SIGMA) / max(len(cells), 1)


def without_wide_regions(mask: UInt8[np.ndarray, "h w"], width: float) -> UInt8[np.ndarray, "h w"]:
    """Return a mask without the regions that are much wider than a rope.

    Args:
        mask: 1 at pixels with the colours of a rope.
        width: Width of the rope [pixels].
    """
    radii = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    wide = (radii > max(MAX_RADIUS_WIDTHS * width, 2.5)).view(np.uint8)
    if not np.any(wide):
        return mask
    from_wide = cv2.distanceTransform(1 - wide, cv2.DIST_L2, 5)
    return mask * (from_wide > 1.6 * width + 1.0)


def _rope_like(
    mask: UInt8[np.ndarray, "h w"], width: float
) -> tuple[UInt8[np.ndarray, "h w"], Bool[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """Mask without too wide, thin or short regions, its skeleton, and its distance transform."""
    mask = without_wide_regions(mask, width)
    radii = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    kept = stats[:, cv2.CC_STAT_AREA] > 0.7 * MIN_LENGTH_WIDTHS * width * MIN_WIDTH_RATIO * width
    kept[0] = False
    mask = kept[labels].view(np.uint8)
    skeleton = skeletonize(mask.view(bool))
    on = labels[skeleton]
    length = np.bincount(on, minlength=count)
    radius = np.bincount(on, radii[skeleton], minlength=count) / np.maximum(length, 1)
    kept &= (length > MIN_LENGTH_WIDTHS * width) & (
        2.0 * radius - 1.0 > MIN_WIDTH_RATIO * width - 0.5
    )
    # A component whose skeleton is no longer than it is wide is a blob.
    kept &= length > 2.0 * MIN_LENGTH_WIDTHS * radius
    mask = kept[labels].view(np.uint8)
    return mask, skeleton & (mask > 0), radii
