"""Judgement of detected ropes against labelled pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, UInt8
from scipy.optimize import linear_sum_assignment

from lariat.perception.image.detector import Detection

RIGHT_DICE = 0.85
"""Dice coefficient from which a rope counts as found [-]."""
LINE_COVERAGE = 0.9
"""Share of a rope's visible pixels that must lie beside its one line [-]."""
LINE_REACH_WIDTHS = 0.75
"""Distance from a line up to which pixels lie beside it [rope widths]."""


@dataclass(frozen=True)
class Judgement:
    """Comparison of what was found with the truth."""

    right_number: bool
    """Whether as many ropes were found as there are."""
    dice: Float64[np.ndarray, "n"]
    """Dice coefficient of each true rope with the rope that was found for it."""
    one_line: Float64[np.ndarray, "n"]
    """1 for each true rope that one found line covers, else 0."""
    doubt: float
    """Stated probability that the answer is wrong; 1 where nothing was found."""
    rope_right: list[bool]
    """Whether each found rope is one of the true ones, in the order of the detection."""

    @property
    def right(self) -> bool:
        """Whether the answer is right as a whole."""
        return self.right_number and bool(np.all(self.dice > RIGHT_DICE))


def judge(labels: UInt8[np.ndarray, "h w"], found: Detection | None) -> Judgement:
    """Return the judgement of a detection.

    Args:
        labels: 0 at the background, k at rope k, from 1 without gaps.
        found: Detection in the same picture; None when nothing was found.
    """
    count = int(labels.max())
    if found is None:
        return Judgement(count == 0, np.zeros(count), np.zeros(count), 1.0, [])
    overlap = dice_matrix(labels, found.labels, count, len(found.ropes))
    true_index, found_index = linear_sum_assignment(-overlap)
    dice, one_line = np.zeros(count), np.zeros(count)
    rope_right = [False] * len(found.ropes)
    for i, j in zip(true_index.tolist(), found_index.tolist(), strict=True):
        dice[i] = overlap[i, j]
        one_line[i] = _is_one_line(labels == i + 1, found, j)
        rope_right[j] = bool(overlap[i, j] > RIGHT_DICE)
    return Judgement(count == len(found.ropes), dice, one_line, found.p_wrong, rope_right)


def dice_matrix(
    labels: UInt8[np.ndarray, "h w"], found: UInt8[np.ndarray, "h w"], count: int, found_count: int
) -> Float64[np.ndarray, "n m"]:
    """Return the Dice coefficients of true and found labels, without the background."""
    size = found_count + 1
    both = np.bincount(labels.ravel().astype(int) * size + found.ravel(), minlength=size)
    both = np.pad(both, (0, (count + 1) * size - len(both))).reshape(count + 1, size)
    total = both.sum(axis=1)[1:, None] + both.sum(axis=0)[None, 1:]
    return 2.0 * both[1:, 1:] / np.maximum(total, 1)


def _is_one_line(mask: np.ndarray, found: Detection, index: int) -> bool:
    """Whether one line of a found rope passes by nearly all pixels of a true one."""
    rope = found.ropes[index]
    rows, columns = np.nonzero(mask)
    some = slice(None, None, max(1, len(rows) // 400))
    pixels = np.stack([columns[some], rows[some]], axis=1)
    line = max(rope.lines, key=lambda r: len(r.pixels)).pixels[::2]
    nearest = np.min(np.linalg.norm(pixels[:, None] - line[None], axis=2), axis=1)
    return float(np.mean(nearest < LINE_REACH_WIDTHS * rope.width)) > LINE_COVERAGE
