"""Calibration of the judge: logistic models fitted to what was right in pictures.

The rendered pictures have seeds that nothing else was tuned on; photographs weigh as much as they.
The fitted coefficients are copied into lariat/perception/image/p_wrong.py. What the judge states
about a picture that it was not fitted to is found by cross-validation.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, UInt8

from benchmarks.perception.instances.judgement import right_lines
from lariat.perception.image import detector, p_wrong
from lariat.perception.image.foreground import find_foregrounds
from lariat.perception.image.p_wrong import RopeFeatures

RIDGE = 0.01
"""Weight of the squared coefficients of the judge's standardised features."""
NEWTON_STEPS = 30
"""Steps of Newton's method."""
MIN_ROPE_SHARE = 0.5
"""Share of a line on ropes below which it is none [-]."""
FOLD_COUNT = 5
"""Number of parts of the cross-validation."""


@dataclass(frozen=True)
class Sample:
    """Lines in one picture."""

    row: str
    """Kind of pictures that it belongs to."""
    lines: list[RopeFeatures]
    """Features of all lines."""
    right: Bool[np.ndarray, "n m"]
    """Whether a line is the one of a true rope."""
    background: Bool[np.ndarray, "m"]
    """Whether a line is on no label."""
    known: Bool[np.ndarray, "m"]
    """Whether the labels tell what a line is."""
    fragment_count: int
    """Number of fragments."""
    seen: Float64[np.ndarray, "k"]
    """Areas that are surely seen: beside all lines, and at each of them [squared widths]."""

    def answer(self) -> tuple[p_wrong.ImageFeatures, float, bool]:
        """Features of the answer, the most doubtful rope's p_wrong, and whether it is wrong."""
        kept = np.array(p_wrong.reported(self.lines), int)
        ropes = [self.lines[k] for k in kept]
        others = [line for k, line in enumerate(self.lines) if k not in kept]
        missing = float(np.sum(self.seen) - np.sum(self.seen[kept + 1]))
        features = p_wrong.image_features(ropes, others, self.fragment_count, missing)
        worst = max((p_wrong.p_wrong(r) for r in ropes), default=0.0)
        count = np.count_nonzero(self.known[kept])
        whole = count == len(self.right) and bool(np.all(self.right[:, kept].any(axis=1)))
        return features, worst, not whole


@dataclass(frozen=True)
class Coefficients:
    """Coefficients of the three models."""

    background: tuple[float, ...]
    rope: tuple[float, ...]
    image: tuple[float, ...]

    def use(self) -> None:
        """Make them those of the judge."""
        p_wrong.BACKGROUND_COEFFICIENTS = self.background
        p_wrong.ROPE_COEFFICIENTS = self.rope
        p_wrong.IMAGE_COEFFICIENTS = self.image


@dataclass(frozen=True)
class Stated:
    """Answer about a picture to which the judge was not fitted."""

    row: str
    """Kind of pictures that it belongs to."""
    doubt: float
    """Stated probability that the answer is wrong."""
    wrong: bool
    """Whether it is."""
    cables: int
    """Number of true ropes."""
    one_line: int
    """Number of those with one right line among the reported ones."""


def sample(
    row: str,
    picture: UInt8[np.ndarray, "h w 3"],
    labels: UInt8[np.ndarray, "h w"],
    complete: bool = True,
) -> Sample | None:
    """Return the lines of a picture with the truth about them; None where nothing is seen.

    Args:
        row: Kind of pictures that it belongs to.
        picture: Red, green, blue.
        labels: 0 at the background, k at rope k.
        complete: Whether ropes that the border cuts off have labels, too.
    """
    foreground = next(iter(find_foregrounds(picture)), None)
    if foreground is None:
        return None
    candidates = detector.measure_candidates(foreground)
    size = candidates.likeness.shape[::-1]
    small = np.asarray(cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST), np.uint8)
    right, on_rope = right_lines(small, candidates.lines)
    shown, _ = detector.label_ropes(candidates.lines, candidates.lab)
    near = cv2.dilate(shown, np.ones((5, 5), np.uint8))
    sure = near[foreground.log_odds > detector.SURE_LOG_ODDS]
    seen = np.bincount(sure, minlength=len(candidates.lines) + 1) / foreground.width**2
    lines = [r.features for r in candidates.lines]
    background = on_rope < MIN_ROPE_SHARE
    cut_off = np.array([line.cut_off > 0.0 for line in lines], bool)
    return Sample(
        row,
        lines,
        right,
        background,
        ~(background & cut_off) | complete,
        candidates.fragment_count,
        seen,
    )


def fit(samples: Iterable[Sample], weights: Iterable[float]) -> Coefficients:
    """Return the coefficients fitted to samples of given weights; they become the judge's."""
    samples, weights = list(samples), list(weights)
    features = np.array([astuple(r) for s in samples for r in s.lines])
    weight = np.array([w for s, w in zip(samples, weights, strict=True) for _ in s.lines])
    background = np.concatenate([s.background for s in samples])
    known = np.concatenate([s.known for s in samples])
    # Where lines lead is learnt from ropes.
    ropes = ~background
    wrong = ~np.concatenate([s.right.any(axis=0) for s in samples])
    first = fit_logistic(features[known], background[known], weight[known], RIDGE)
    second = fit_logistic(features[ropes], wrong[ropes], weight[ropes], RIDGE)
    Coefficients(first, second, p_wrong.IMAGE_COEFFICIENTS).use()
    answers = [s.answer() for s in samples]
    image_features = np.array([astuple(f) for f, _, _ in answers])
    wrong = np.array([w for _, _, w in answers])
    third = fit_logistic(image_features, wrong, np.array(weights), RIDGE)
    coefficients = Coefficients(first, second, third)
    coefficients.use()
    return coefficients


def cross_validated(samples: list[Sample], weights: list[float]) -> list[Stated]:
    """Return what the judge states about answers that it was not fitted to."""
    stated = []
    for k in range(FOLD_COUNT):
        inside = [n for n in range(len(samples)) if n % FOLD_COUNT != k]
        fit([samples[n] for n in inside], [weights[n] for n in inside])
        for s in samples[k::FOLD_COUNT]:
            features, worst, wrong = s.answer()
            doubt = max(worst, p_wrong.p_wrong(features))
            one_line = int(s.right[:, p_wrong.reported(s.lines)].any(axis=1).sum())
            stated.append(Stated(s.row, doubt, wrong, len(s.right), one_line))
    return stated


def fit_logistic(
    features: Float64[np.ndarray, "n m"],
    wrong: Bool[np.ndarray, "n"],
    weights: Float64[np.ndarray, "n"] | None = None,
    ridge: float = 0.002,
) -> tuple[float, ...]:
    """Return intercept and slopes of the log odds of being wrong, by Newton's method.

    Args:
        features: Features, one row for each sample.
        wrong: Whether the sample is wrong.
        weights: Weight of each sample; None: all the same.
        ridge: Weight of the squared slopes of the standardised features [-].
    """
    weights = np.ones(len(wrong)) if weights is None else weights / np.mean(weights)
    middle, spread = features.mean(axis=0), features.std(axis=0) + 1e-9
    x = np.column_stack([np.ones(len(features)), (features - middle) / spread])
    penalty = ridge * len(features) * np.eye(x.shape[1])
    penalty[0, 0] = 0.0
    beta = np.zeros(x.shape[1])
    for _ in range(NEWTON_STEPS):
        p = 1.0 / (1.0 + np.exp(-np.clip(x @ beta, -30.0, 30.0)))
        gradient = x.T @ (weights * (p - wrong)) + penalty @ beta
        hessian = (x * (weights * p * (1.0 - p))[:, None]).T @ x + penalty
        beta -= np.linalg.solve(hessian + 1e-9 * np.eye(x.shape[1]), gradient)
    slopes = beta[1:] / spread
    return (float(beta[0] - slopes @ middle), *slopes.tolist())
