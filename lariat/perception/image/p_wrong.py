"""Judge of lines: the probability that a line is no rope, and that an answer is wrong.

Logistic models of what is known without the truth: how much worse the next pairing of fragments
is, how even the width is, how distinct both sides are, and whether the network sees the same. The
coefficients are fitted by `lariat bench perception instances --fit` to rendered pictures that
nothing else was tuned on and to photographs, and checked on others (docs/results/perception.md).
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np

DOUBTFUL = 0.3
"""Probability of being wrong above which an answer is said to be doubtful [-]: below one half, for
a wrong rope that is believed costs more than a right one that is looked at again."""
MAX_P_BACKGROUND = 0.5
"""Probability of being no rope up to which a line is reported as a rope [-]."""
MAX_BEST_P_WRONG = 0.5
"""Least p_wrong of all lines up to which any is reported [-]: grain and print have many lines, none
of which is likely a whole rope."""
MIN_RELATIVE_WIDTH = 0.35
"""Least width of a rope, relative to that of the line that covers most of the image [-]."""
MAX_MARGIN = 2.0
"""Margin of a pairing above which it is certain [-]."""
MAX_LOG_ODDS = 6.0
"""Limit of the log odds of a rope among the features of its image [-]."""
BACKGROUND_COEFFICIENTS = (
    5.1372,
    -1.5086,
    1.1782,
    2.0305,
    -0.0380,
    0.2507,
    1.4752,
    1.3083,
    0.7653,
    3.1092,
    -2.3518,
    -0.3692,
)
"""Intercept, and one coefficient for each feature of a line, of the odds that it is no rope."""
ROPE_COEFFICIENTS = (
    4.4978,
    -0.6803,
    12.8336,
    0.4455,
    2.2178,
    -1.5930,
    3.9800,
    -3.2767,
    -0.3230,
    0.2557,
    -0.7493,
    -1.0481,
)
"""The same of the odds that it is not exactly one whole rope."""
IMAGE_COEFFICIENTS = (-0.8976, 0.2463, 0.2888, -0.9689, 0.0850, 1.6414, 0.2565, -3.2286, 0.1867)
"""Intercept, and one coefficient for each feature of an image."""


@dataclass(frozen=True)
class RopeFeatures:
    """What is known of a rope without the truth."""

    length: float
    """Logarithm of its length in widths."""
    unevenness: float
    """Standard deviation of its width, relative to its mean [-]."""
    ambiguity: float
    """Exponential of minus the margin of its least clear crossing, 0..1."""
    loose_ends: float
    """Number of its ends that lie at a crossing and found no partner."""
    contrast: float
    """Logarithm of its distance from the more similar of its sides [Lab]."""
    hidden: float
    """Share of its axis that is bridged, 0..1."""
    shadow: float
    """Share of its axis that could be a shadow of its sides, 0..1."""
    unseen: float
    """Mean of minus the network's log odds along its axis, limited."""
    at_border: float
    """Share of its axis that lies beside the image's border, 0..1."""
    cut_off: float
    """1 where an end, but not most of it, lies at the image's border, which cuts it off; else 0."""
    relative_width: float
    """Logarithm of its width, relative to that of most of the foreground."""


@dataclass(frozen=True)
class ImageFeatures:
    """What is known of the answer about an image without the truth."""

    worst_rope: float
    """Log odds of the most doubtful rope being wrong, limited; 0 without ropes."""
    mean_rope: float
    """Mean of the log odds of all ropes, limited; 0 without ropes."""
    none: float
    """1 where no rope is reported, else 0."""
    likeliest_other: float
    """Log odds of the likeliest of the other lines being a rope, limited."""
    count: float
    """Logarithm of one plus the number of ropes."""
    pieces: float
    """Logarithm of the number of fragments for each rope."""
    weakest: float
    """Least contrast of a rope, relative to the largest one [-]; 1 without ropes."""
    missing: float
    """Logarithm of one plus the area that the network surely sees beside the ropes [widths²]."""


def image_features(
    ropes: list[RopeFeatures], others: list[RopeFeatures], fragment_count: int, missing: float
) -> ImageFeatures:
    """Return what is known of the answer about an image.

    Args:
        ropes: Features of its ropes.
        others: Features of the lines that are no ropes.
        fragment_count: Number of fragments that the skeleton was cut into.
        missing: Area that the network surely sees beside the ropes [squared widths].
    """
    odds = [_limited(log_odds(r, ROPE_COEFFICIENTS)) for r in ropes]
    contrasts = [r.contrast for r in ropes] or [0.0]
    likeliest = max((-log_odds(r, BACKGROUND_COEFFICIENTS) for r in others), default=-np.inf)
    return ImageFeatures(
        worst_rope=max(odds, default=0.0),
        mean_rope=float(np.mean(odds)) if odds else 0.0,
        none=float(not ropes),
        likeliest_other=_limited(likeliest),
        count=float(np.log1p(len(ropes))),
        pieces=float(np.log(max(fragment_count, 1) / max(len(ropes), 1))),
        weakest=float(np.exp(min(contrasts) - max(contrasts))),
        missing=float(np.log1p(missing)),
    )


def reported(lines: list[RopeFeatures]) -> list[int]:
    """Return the indices of the lines that are reported as ropes."""
    likely = [k for k, line in enumerate(lines) if p_background(line) <= MAX_P_BACKGROUND]
    wrong = {k: p_wrong(lines[k]) for k in likely}
    if min(wrong.values(), default=1.0) > MAX_BEST_P_WRONG:
        return []
    # Joints of tiles and seams are as long as ropes, but not as wide.
    main = max((lines[k] for k in likely), key=lambda r: r.length + 2.0 * r.relative_width)
    least = main.relative_width + np.log(MIN_RELATIVE_WIDTH)
    return [k for k in likely if lines[k].relative_width > least]


def p_background(features: RopeFeatures) -> float:
    """Return the probability that a line is no rope."""
    return _logistic(log_odds(features, BACKGROUND_COEFFICIENTS))


def p_wrong(features: RopeFeatures | ImageFeatures) -> float:
    """Return the probability that a rope, or the answer about an image, is wrong."""
    rope = isinstance(features, RopeFeatures)
    return _logistic(log_odds(features, ROPE_COEFFICIENTS if rope else IMAGE_COEFFICIENTS))


def ambiguity_of_margin(margin: float) -> float:
    """Return the ambiguity of a crossing from the margin of its pairing, 0..1."""
    return float(np.exp(-3.0 * min(margin, MAX_MARGIN)))


def log_odds(features: RopeFeatures | ImageFeatures, coefficients: tuple[float, ...]) -> float:
    """Return the logarithm of the odds of a logistic model."""
    return float(coefficients[0] + np.dot(coefficients[1:], astuple(features)))


def _limited(odds: float) -> float:
    return float(np.clip(odds, -MAX_LOG_ODDS, MAX_LOG_ODDS))


def _logistic(odds: float) -> float:
    return float(1.0 / (1.0 + np.exp(-odds)))
