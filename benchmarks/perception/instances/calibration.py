"""Calibration of doubt: logistic models fitted to what was right in rendered pictures.

The pictures are those of the tuning generator, with seeds that nothing else was tuned on. The
fitted coefficients are copied into lariat/perception/image/p_wrong.py.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from itertools import islice

import numpy as np
from jaxtyping import Bool, Float64
from scipy.optimize import linear_sum_assignment

from benchmarks.perception.instances.judgement import RIGHT_DICE, dice_matrix
from benchmarks.perception.pictures.generators import Ground, tuning_picture
from benchmarks.perception.pictures.renderer import LabelledPicture
from lariat.perception.image import detector, p_wrong
from lariat.perception.image.foreground import Foreground, find_foregrounds
from lariat.perception.image.p_wrong import RopeFeatures

FIRST_SEED = 100_000
"""First seed of the pictures for the fit; tuning uses lower ones."""
RIDGE = 0.02
"""Weight of the squared coefficients of the standardised features."""
EVERY_WAY_STRIDE = 4
"""Stride of the pictures in which every way of finding the foreground is sampled: the others than
the network are rarely needed."""
NEWTON_STEPS = 30
"""Steps of Newton's method."""


@dataclass(frozen=True)
class Sample:
    """Detection in one picture, with every rope that was assembled."""

    ropes: list[RopeFeatures]
    """Features of its ropes, the incredible included."""
    dice: Float64[np.ndarray, "n m"]
    """Dice coefficients of true and found ropes."""
    shares: list[float]
    """Share of the skeleton that each of its ropes explains, 0..1."""
    fragment_count: int
    """Number of fragments."""
    by_color: bool
    """Whether it was found by the colours of proposals."""
    seen: Float64[np.ndarray, "k"]
    """Shares of what the network sees: of no rope, and of each of its ropes."""


def samples(count: int) -> Iterator[Sample]:
    """Yield samples of what the network finds in rendered pictures, and in some of all ways."""
    grounds: tuple[Ground, Ground] = ("plain", "clutter")
    for k in range(count):
        picture = tuning_picture(FIRST_SEED + k, 1 + k % 3, grounds[(k // 3) % 2])
        print(f"\rpicture {k + 1} of {count}", end="", file=sys.stderr)
        ways = None if k % EVERY_WAY_STRIDE == 0 else 1
        for foreground in islice(find_foregrounds(picture.color), ways):
            yield from _sample(picture, foreground)
    print(file=sys.stderr)


def _sample(picture: LabelledPicture, foreground: Foreground) -> Iterator[Sample]:
    found = detector.measure_candidates(foreground)
    if found is None:
        return
    labels, _ = detector.label_ropes(found.ropes, found.lab)
    yield Sample(
        [r.features for r in found.ropes],
        dice_matrix(picture.labels, labels, len(picture.cables), len(found.ropes)),
        found.shares,
        found.fragment_count,
        foreground.by_color,
        detector.seen_shares(foreground.log_odds, labels, len(found.ropes)),
    )


def fit(count: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the coefficients of the models of ropes and of images."""
    every = list(samples(count))
    features = np.array([astuple(r) for s in every for r in s.ropes])
    wrong = np.concatenate([~_right_ropes(s) for s in every])
    ropes = fit_logistic(features, wrong)
    p_wrong.ROPE_COEFFICIENTS = ropes
    images, image_wrong = [], []
    for s in every:
        kept = p_wrong.believed(s.ropes)
        explained = sum(s.shares[k] for k in kept)
        believed = [s.ropes[k] for k in kept]
        missing = max(0.0, float(np.sum(s.seen) - sum(s.seen[k + 1] for k in kept)))
        known = p_wrong.image_features(believed, explained, s.fragment_count, s.by_color, missing)
        images.append(astuple(known))
        right = len(kept) == len(s.dice) and bool(np.all(_right_ropes(s)[kept]))
        image_wrong.append(not right)
    return ropes, fit_logistic(np.array(images), np.array(image_wrong))


def _right_ropes(sample: Sample) -> Bool[np.ndarray, "m"]:
    right = np.zeros(len(sample.ropes), bool)
    for i, j in zip(*linear_sum_assignment(-sample.dice), strict=True):
        right[j] = sample.dice[i, j] > RIGHT_DICE
    return right


def fit_logistic(
    features: Float64[np.ndarray, "n m"], wrong: Bool[np.ndarray, "n"]
) -> tuple[float, ...]:
    """Return intercept and slopes of the log odds of being wrong, by Newton's method."""
    middle, spread = features.mean(axis=0), features.std(axis=0) + 1e-9
    x = np.column_stack([np.ones(len(features)), (features - middle) / spread])
    penalty = RIDGE * len(features) * np.eye(x.shape[1]) / 10.0
    penalty[0, 0] = 0.0
    beta = np.zeros(x.shape[1])
    for _ in range(NEWTON_STEPS):
        p = 1.0 / (1.0 + np.exp(-np.clip(x @ beta, -30.0, 30.0)))
        gradient = x.T @ (p - wrong) + penalty @ beta
        hessian = (x * (p * (1.0 - p))[:, None]).T @ x + penalty + 1e-9 * np.eye(x.shape[1])
        beta -= np.linalg.solve(hessian, gradient)
    slopes = beta[1:] / spread
    return (float(beta[0] - slopes @ middle), *slopes.tolist())
