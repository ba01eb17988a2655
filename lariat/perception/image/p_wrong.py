"""Doubt: the probability that a rope, or the answer about a whole image, is wrong.

Logistic models of what is known without the truth: how sharply ropes bend from one fragment to the
next, how much worse the next pairing is, how even the width is, how distinct both sides are, and
whether the network sees the same. The coefficients are fitted by `lariat bench perception instances
--fit` on rendered pictures that nothing else was tuned on, and checked on those of another
generator (docs/results/perception.md)."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np

DOUBTFUL = 0.3
"""Doubt above which an answer is said to be doubtful [-]: below one half, for a wrong rope that is
believed costs more than a right one that is looked at again."""
MAX_MARGIN = 2.0
"""Margin of a pairing above which it is certain [-]."""
MAX_LOG_ODDS = 6.0
"""Limit of the log odds of a rope among the features of its image [-]."""
DROPPED_LOG_ODDS = 1.0
"""Log odds of being wrong above which a rope is dropped [-]."""
SEEN_LOG_ODDS, SEEN_UNEVENNESS, SEEN_LENGTH = 3.0, 0.2, 40.0
"""Mean log odds of the network along a rope from which it is kept in any case, if its unevenness is
below the second [-] or its length above the third [rope widths]: doubtful is then where it leads to
and how wide it is, not whether it is there."""
ROPE_COEFFICIENTS = (
    0.684,
    -1.2044,
    18.1525,
    0.5737,
    2.9031,
    2.4671,
    0.2458,
    -4.1715,
    -0.4818,
    0.4376,
    7.0739,
)
"""Intercept, and one coefficient for each feature of a rope."""
IMAGE_COEFFICIENTS = (
    -2.7408,
    0.5272,
    0.3216,
    -1.6343,
    1.6349,
    0.8312,
    -0.722,
    1.5429,
    22.9531,
)
"""Intercept, and one coefficient for each feature of an image."""


@dataclass(frozen=True)
class RopeFeatures:
    """What is known of a rope without the truth."""

    length: float
    """Logarithm of its length in widths."""
    unevenness: float
    """Standard deviation of its width, relative to its mean [-]."""
    worst_pair: float
    """Largest cost of a pair of its fragments [-]."""
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
    narrowing: float
    """Absolute logarithm of its width between the flanks, relative to that of the foreground."""


@dataclass(frozen=True)
class ImageFeatures:
    """What is known of the answer about an image without the truth."""

    worst_rope: float
    """Log odds of the most doubtful rope being wrong, limited."""
    mean_rope: float
    """Mean of the log odds of all ropes, limited."""
    unexplained: float
    """Share of the skeleton that belongs to no rope, 0..1."""
    count: float
    """Logarithm of the number of ropes."""
    by_color: float
    """1 where the ropes were found by colours of proposals, whatever the ground is, else 0."""
    pieces: float
    """Logarithm of the number of fragments for each rope."""
    weakest: float
    """Least contrast of a rope, relative to the largest one [-]."""
    missing: float
    """Share of what the network sees that belongs to no rope, 0..1."""


def believed(ropes: list[RopeFeatures]) -> list[int]:
    """Return the indices of the ropes that are kept: all but the incredible, at least one."""
    odds = [log_odds(r) for r in ropes]
    seen = [
        r.unseen < -SEEN_LOG_ODDS
        and (r.unevenness < SEEN_UNEVENNESS or r.length > np.log(SEEN_LENGTH))
        for r in ropes
    ]
    likely = [k for k, o in enumerate(odds) if o < DROPPED_LOG_ODDS or seen[k]]
    return likely or [int(np.argmin(odds))]


def image_features(
    ropes: list[RopeFeatures],
    explained: float,
    fragment_count: int,
    by_color: bool,
    missing: float,
) -> ImageFeatures:
    """Return what is known of the answer about an image.

    Args:
        ropes: Features of its ropes, at least one.
        explained: Share of the skeleton that belongs to these ropes, 0..1.
        fragment_count: Number of fragments that the skeleton was cut into.
        by_color: Whether they were found by the colours of proposals.
        missing: Share of what the network sees that belongs to none of them, 0..1.
    """
    odds = np.clip([log_odds(r) for r in ropes], -MAX_LOG_ODDS, MAX_LOG_ODDS)
    contrasts = [r.contrast for r in ropes]
    return ImageFeatures(
        worst_rope=float(np.max(odds)),
        mean_rope=float(np.mean(odds)),
        unexplained=1.0 - explained,
        count=float(np.log(len(ropes))),
        by_color=float(by_color),
        pieces=float(np.log(fragment_count / len(ropes))),
        weakest=float(np.exp(min(contrasts) - max(contrasts))),
        missing=missing,
    )


def ambiguity_of_margin(margin: float) -> float:
    """Return the ambiguity of a crossing from the margin of its pairing, 0..1."""
    return float(np.exp(-3.0 * min(margin, MAX_MARGIN)))


def log_odds(features: RopeFeatures | ImageFeatures) -> float:
    """Return the logarithm of the odds that a rope, or the answer about an image, is wrong."""
    rope = isinstance(features, RopeFeatures)
    intercept, *slopes = ROPE_COEFFICIENTS if rope else IMAGE_COEFFICIENTS
    return float(intercept + np.dot(slopes, astuple(features)))


def p_wrong(features: RopeFeatures | ImageFeatures) -> float:
    """Return the probability that a rope, or the answer about an image, is wrong."""
    return float(1.0 / (1.0 + np.exp(-log_odds(features))))
