"""Flanks of a rope: where its colour changes fastest on both sides of its axis."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64
from scipy.ndimage import median_filter, uniform_filter1d

SEARCH_WIDTHS = (0.28, 0.85)
"""Range of the distance from the axis in which a flank is searched [rope widths]."""
SAMPLE_SPACING, MIN_SAMPLES_PER_WIDTH = 0.5, 12.0
"""Largest distance of the samples across the rope [pixels], and their least number per width."""
SMOOTHING_WIDTHS = 1.5
"""Length over which profiles are averaged along the rope [rope widths]."""
SHIFT_WINDOW_WIDTHS = 3.0
"""Length of the running median over the axis's shift [rope widths]."""
MAX_SHIFT_WIDTHS = 0.3
"""Largest shift of the axis [rope widths]."""
DISTINCT_SLOPE = 0.45
"""Slope of a flank, relative to the largest one on its side [-]: the lit half of a rope may differ
more from its dark half than that from the table."""
MIN_CLEAR_SHARE = 0.2
"""Share of the axis that must be clear for its flanks to be measured [-]."""


def center_between_flanks(
    lab: Float32[np.ndarray, "h w 3"],
    pixels: Float64[np.ndarray, "k 2"],
    normals: Float64[np.ndarray, "k 2"],
    clear: Bool[np.ndarray, "k"],
    width: float,
) -> tuple[Float64[np.ndarray, "k 2"], float]:
    """Return the axis in the middle between a rope's flanks, and its width [pixels].

    Args:
        lab: Image in Lab.
        pixels: Columns and rows of the axis.
        normals: Unit normals of the axis.
        clear: False near crossings.
        width: Approximate width of the rope [pixels].
    """
    if np.count_nonzero(clear) < max(5.0, MIN_CLEAR_SHARE * len(clear)):
        return pixels, width
    nearest, farthest = SEARCH_WIDTHS
    reach = farthest * width + 1.0
    spacing = min(SAMPLE_SPACING, width / MIN_SAMPLES_PER_WIDTH)
    offsets = np.arange(-reach, reach + spacing, spacing)
    around = (pixels[:, None] + offsets[:, None] * normals[:, None]).astype(np.float32)
    profile = cv2.remap(lab, around[..., 0], around[..., 1], cv2.INTER_LINEAR)
    window = max(3, round(SMOOTHING_WIDTHS * width))
    weight = uniform_filter1d(clear.astype(float), window)[:, None, None]
    profile = uniform_filter1d(profile * clear[:, None, None], window, axis=0)
    profile = profile / np.maximum(weight, 1e-6)
    slope = np.linalg.norm(profile[:, 2:] - profile[:, :-2], axis=2)
    offsets = offsets[1:-1]
    flanks = []
    for sign in (-1.0, 1.0):
        searched = (sign * offsets > nearest * width) & (sign * offsets < farthest * width)
        outward = np.flatnonzero(searched)[:: int(sign)]
        flanks.append(_outermost(slope[:, outward], offsets[outward]))
    left, right = flanks
    measured = float(np.median((right - left)[clear]))
    # Where one flank has no contrast, the other and the width tell the axis.
    strong = [np.max(slope[:, s * offsets > nearest * width], axis=1) for s in (-1.0, 1.0)]
    share = strong[0] / np.maximum(strong[0] + strong[1], 1e-6)
    shift = share * (left + measured / 2.0) + (1.0 - share) * (right - measured / 2.0)
    at = np.flatnonzero(clear)
    shift = np.interp(np.arange(len(clear)), at, shift[at])
    span = min(len(shift), 2 * (round(SHIFT_WINDOW_WIDTHS * width) // 2) + 1)
    shift = uniform_filter1d(median_filter(shift, span, mode="nearest"), span // 2 + 1)
    shift = np.clip(shift, -MAX_SHIFT_WIDTHS * width, MAX_SHIFT_WIDTHS * width)
    return pixels + shift[:, None] * normals, measured


def _outermost(
    slope: Float64[np.ndarray, "k m"], offsets: Float64[np.ndarray, "m"]
) -> Float64[np.ndarray, "k"]:
    """Sub-sample place of the outermost distinct peak of the slope in every row."""
    rows = np.arange(len(slope))
    before, here, after = slope[:, :-2], slope[:, 1:-1], slope[:, 2:]
    top = slope.max(axis=1, keepdims=True)
    peaks = (here >= before) & (here >= after) & (here > DISTINCT_SLOPE * top)
    # The last one in the order outwards; the largest slope where there is no peak.
    best = peaks.shape[1] - np.argmax(peaks[:, ::-1], axis=1)
    best = np.where(np.any(peaks, axis=1), best, np.argmax(slope, axis=1))
    inner = np.clip(best, 1, slope.shape[1] - 2)
    before, here, after = (slope[rows, inner + d] for d in (-1, 0, 1))
    curvature = before - 2.0 * here + after
    peak = np.where(curvature < -1e-6, 0.5 * (before - after) / np.minimum(curvature, -1e-6), 0.0)
    peak = np.where(best == inner, np.clip(peak, -0.5, 0.5), 0.0)
    return offsets[best] + peak * (offsets[1] - offsets[0])
