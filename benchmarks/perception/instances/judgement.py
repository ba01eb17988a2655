"""Judgement of detected ropes against labelled pictures."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, UInt8
from scipy.optimize import linear_sum_assignment

from lariat.perception.image.detector import DetectedRope, Detection

LINE_COVERAGE = 0.9
"""Share of a rope's visible pixels that must lie beside its one line [-]."""
LINE_PRECISION = 0.8
"""Share of the line that must lie beside these pixels [-]: ferrules at its ends are no rope."""
LINE_REACH_WIDTHS = 0.75
"""Distance from a line up to which pixels lie beside it [widths of the true rope]."""
WIDTH_PERCENTILE = 90.0
"""Percentile of the distances from a rope's outside that is half its width [%]."""


@dataclass(frozen=True)
class Judgement:
    """Comparison of what was found with the truth."""

    right_number: bool
    """Whether as many ropes were found as there are."""
    dice: Float64[np.ndarray, "n"]
    """Dice coefficient of each true rope with the rope that was found for it."""
    one_line: Float64[np.ndarray, "n"]
    """1 for each true rope that one found line follows, and no more than it, else 0."""
    doubt: float
    """Stated probability that the answer is wrong."""

    @property
    def right(self) -> bool:
        """Whether the answer is right as a whole."""
        return self.right_number and bool(np.all(self.one_line))


def judge(labels: UInt8[np.ndarray, "h w"], detection: Detection) -> Judgement:
    """Return the judgement of a detection.

    Args:
        labels: 0 at the background, k at rope k, from 1 without gaps.
        detection: Detection in the same picture.
    """
    count = int(labels.max())
    overlap = dice_matrix(labels, detection.labels, count, len(detection.ropes))
    right, _ = right_lines(labels, detection.ropes)
    dice = np.zeros(count)
    for i, j in zip(*linear_sum_assignment(-overlap), strict=True):
        dice[i] = overlap[i, j]
    right_number = count == len(detection.ropes)
    one_line = right.any(axis=1).astype(float)
    return Judgement(right_number, dice, one_line, detection.p_wrong)


def dice_matrix(
    labels: UInt8[np.ndarray, "h w"], shown: UInt8[np.ndarray, "h w"], count: int, shown_count: int
) -> Float64[np.ndarray, "n m"]:
    """Return the Dice coefficients of true and found labels, without the background."""
    size = shown_count + 1
    both = np.bincount(labels.ravel().astype(int) * size + shown.ravel(), minlength=size)
    both = np.pad(both, (0, (count + 1) * size - len(both))).reshape(count + 1, size)
    total = both.sum(axis=1)[1:, None] + both.sum(axis=0)[None, 1:]
    return 2.0 * both[1:, 1:] / np.maximum(total, 1)


def right_lines(
    labels: UInt8[np.ndarray, "h w"], ropes: list[DetectedRope]
) -> tuple[Bool[np.ndarray, "n m"], Float64[np.ndarray, "m"]]:
    """Return which line is the one of which true rope, and each line's share on any rope.

    Args:
        labels: 0 at the background, k at rope k.
        ropes: Found ropes.
    """
    count, high = int(labels.max()), np.array(labels.shape[::-1]) - 1
    lines = [max(r.lines, key=lambda line: len(line.pixels)).pixels for r in ropes]
    at = [np.clip(np.rint(line).astype(int), 0, high) for line in lines]
    right, on_any = np.zeros((count, len(ropes)), bool), np.zeros((count, len(ropes)))
    for i in range(count):
        mask = (labels == i + 1).view(np.uint8)
        rows, columns = np.nonzero(mask)
        if len(rows) == 0:
            continue
        inside = cv2.distanceTransform(mask, cv2.DIST_L2, 5)[rows, columns]
        reach = 2.0 * LINE_REACH_WIDTHS * float(np.percentile(inside, WIDTH_PERCENTILE))
        outside = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5)
        some = slice(None, None, max(1, len(rows) // 400))
        pixels = np.stack([columns[some], rows[some]], axis=1)
        for j, line in enumerate(lines):
            on = float(np.mean(outside[at[j][:, 1], at[j][:, 0]] < reach))
            on_any[i, j] = on
            if on > LINE_PRECISION:
                nearest = np.min(np.linalg.norm(pixels[:, None] - line[None, ::2], axis=2), axis=1)
                right[i, j] = np.mean(nearest < reach) > LINE_COVERAGE
    return right, np.minimum(on_any.sum(axis=0), 1.0)
