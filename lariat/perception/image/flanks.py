"""Flanks of a rope: where its colour changes fastest on both sides of its axis."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64
from scipy.ndimage import median_filter, uniform_filter1d

from lariat.perception.image.contrast import tint_and_brightness

REACH_WIDTHS, REACH_PIXELS = 1.0, 3.0
"""Distance from the axis up to which a flank is searched: [rope widths] + [pixels]."""
SAMPLE_SPACING, MIN_SAMPLES_PER_WIDTH = 0.5, 12.0
"""Largest distance of the samples across the rope [pixels], and their least number per width."""
SMOOTHING_WIDTHS = 1.5
"""Length over which profiles are averaged along the rope [rope widths]."""
SHIFT_WINDOW_WIDTHS = 3.0
"""Length of the running median over the axis's shift [rope widths]."""
MAX_SHIFT_WIDTHS = 0.3
"""Largest shift of the axis [rope widths]."""
FLANK_SIGMA_WIDTHS, MIN_FLANK_SIGMA = 0.1, 0.8
"""Standard deviation of a flank's distance from the edge of the foreground: [rope widths], and at
least [pixels]."""
CORE_WIDTHS = 0.2
"""Distance from the axis up to which surely the rope is seen [rope widths]."""
MIN_CORE_TINT = 20.0
"""Difference of chroma between rope and ground from which a shadow is told from the rope [Lab]."""
WEAK_TINT_SHARE = 0.55
"""Tint, relative to the rope's in the same light, below which the ground is seen [-]."""
SHADOW_LIGHTNESS = 0.93
"""Lightness of a shadow, relative to that of the ground beside it, at most [-]."""
WIDTH_PERCENTILE = 80.0
"""Percentile of the local widths that is the rope's width [%]: where light comes from one side, the
dark flank is lost in the ground, and the rope looks narrower than it is."""
WIDTH_EXCESS = 0.3
"""Amount by which that percentile exceeds the width [pixels]."""
MIN_MEASURED_SHARE, FOREGROUND_SHARE = 0.8, 0.95
"""Width between flanks, relative to that of the foreground, below which they are those of a
highlight on the rope unless the foreground holds its shadow as well, and share of the foreground's
width that is then the rope's [-]."""
SLOPE_EXPONENT = 4
"""Exponent of the slopes that tell which flank is the surer one [-]."""
MIN_CLEAR_SHARE = 0.2
"""Share of the axis that must be clear for its flanks to be measured [-]."""


def center_between_flanks(
    lab: Float32[np.ndarray, "h w 3"],
    evidence: Float32[np.ndarray, "h w"],
    pixels: Float64[np.ndarray, "k 2"],
    normals: Float64[np.ndarray, "k 2"],
    clear: Bool[np.ndarray, "k"],
    width: float,
) -> tuple[Float64[np.ndarray, "k 2"], float]:
    """Return the axis in the middle between a rope's flanks, and its width [pixels].

    Args:
        lab: Image in Lab.
        evidence: Log odds that a pixel shows a rope; zero at the edge of the foreground.
        pixels: Columns and rows of the axis.
        normals: Unit normals of the axis.
        clear: False near crossings.
        width: Approximate width of the rope [pixels].
    """
    least = max(5.0, MIN_CLEAR_SHARE * len(clear))
    if np.count_nonzero(clear) < least:
        return pixels, width
    reach = REACH_WIDTHS * width + REACH_PIXELS
    spacing = min(SAMPLE_SPACING, width / MIN_SAMPLES_PER_WIDTH)
    half = int(np.ceil(reach / spacing))
    offsets = spacing * np.arange(-half, half + 1)
    around = (pixels[:, None] + offsets[:, None] * normals[:, None]).astype(np.float32)
    window = max(3, round(SMOOTHING_WIDTHS * width))
    weight = np.maximum(uniform_filter1d(clear.astype(np.float32), window), 1e-6)[:, None, None]

    def profile(image: Float32[np.ndarray, "h w c"]) -> Float32[np.ndarray, "k m c"]:
        seen = cv2.remap(image, around[..., 0], around[..., 1], cv2.INTER_LINEAR)
        seen = seen.reshape(*around.shape[:2], -1) * clear[:, None, None]
        return uniform_filter1d(seen, window, axis=0) / weight

    colors, inside = profile(lab), profile(evidence)[..., 0]
    shadow = _shadow_beside(colors, offsets, clear, width)
    with_shadow = np.mean(np.any(shadow & (inside > 0.0), axis=1)[clear]) > 0.5
    inside = np.where(shadow, -1.0, inside)
    slope = np.linalg.norm(colors[:, 2:] - colors[:, :-2], axis=2)
    sigma = max(FLANK_SIGMA_WIDTHS * width, MIN_FLANK_SIGMA)
    sides = [_flank(slope[:, ::sign], inside[:, ::sign], offsets, sigma) for sign in (-1, 1)]
    (left, left_slope), (right, right_slope) = sides
    measurable = clear & np.isfinite(left + right)
    if np.count_nonzero(measurable) < least:
        return pixels, width
    measured = float(np.percentile((left + right)[measurable], WIDTH_PERCENTILE)) - WIDTH_EXCESS
    if measured < MIN_MEASURED_SHARE * width and not with_shadow:
        return pixels, FOREGROUND_SHARE * width
    # Where one flank has no contrast, the other and the width tell the axis.
    share = left_slope**SLOPE_EXPONENT
    share = share / np.maximum(share + right_slope**SLOPE_EXPONENT, 1e-9)
    shift = share * (measured / 2.0 - left) + (1.0 - share) * (right - measured / 2.0)
    at = np.flatnonzero(measurable)
    shift = np.interp(np.arange(len(clear)), at, shift[at])
    span = min(len(shift), 2 * (round(SHIFT_WINDOW_WIDTHS * width) // 2) + 1)
    shift = uniform_filter1d(median_filter(shift, span, mode="nearest"), span // 2 + 1)
    shift = np.clip(shift, -MAX_SHIFT_WIDTHS * width, MAX_SHIFT_WIDTHS * width)
    return pixels + shift[:, None] * normals, measured


def _shadow_beside(
    colors: Float32[np.ndarray, "k m 3"],
    offsets: Float64[np.ndarray, "m"],
    clear: Bool[np.ndarray, "k"],
    width: float,
) -> Bool[np.ndarray, "k m"]:
    """Where a rope that has another tint than the ground shows the ground's, darker."""
    ends = colors[:, [0, -1]]
    ground = ends[np.arange(len(ends)), np.argmax(ends[..., 0], axis=1)][:, None]
    tint, _ = tint_and_brightness(colors, ground)
    core = np.abs(offsets) < CORE_WIDTHS * width
    strongest = np.max(tint[:, core], axis=1)
    if np.median(strongest[clear]) < MIN_CORE_TINT:
        return np.zeros(tint.shape, bool)
    # Tint fades with the light, on the dark flank of a rope as elsewhere.
    light = np.maximum(colors[..., 0], 1.0)
    tinted = tint / light
    weak = tinted < WEAK_TINT_SHARE * np.max(tinted[:, core], axis=1, keepdims=True)
    darker = light < SHADOW_LIGHTNESS * ground[..., 0]
    return weak & darker & ~core


def _flank(
    slope: Float32[np.ndarray, "k n"],
    inside: Float32[np.ndarray, "k m"],
    offsets: Float64[np.ndarray, "m"],
    sigma: float,
) -> tuple[Float64[np.ndarray, "k"], Float32[np.ndarray, "k"]]:
    """Distance of the flank on the side of positive offsets from the axis, and its slope.

    The distance is NaN where the axis is not inside the foreground, or where that does not end.
    """
    rows, middle, spacing = np.arange(len(inside)), len(offsets) // 2, offsets[1] - offsets[0]
    outward = inside[:, middle:]
    first = np.maximum(np.argmax(outward <= 0.0, axis=1), 1)
    before, after = outward[rows, first - 1], outward[rows, first]
    edge = spacing * (first - 1 + before / np.maximum(before - after, 1e-6))
    edge = np.where((outward[:, 0] > 0.0) & (after <= 0.0), edge, np.nan)
    # The colour changes fastest at a flank; far from the edge of the foreground it is no flank.
    near = np.exp(-0.5 * ((offsets[1:-1] - edge[:, None]) / sigma) ** 2)
    likely = np.nan_to_num(near * slope)
    best = np.clip(np.argmax(likely, axis=1), 1, likely.shape[1] - 2)
    before, here, after = (likely[rows, best + d] for d in (-1, 0, 1))
    curvature = np.minimum(before - 2.0 * here + after, -1e-9)
    peak = np.clip(0.5 * (before - after) / curvature, -0.5, 0.5)
    return offsets[best + 1] + spacing * peak + 0.0 * edge, slope[rows, best]
