"""Ropes as instances in single pictures: `lariat bench perception instances`.

Rendered pictures and ordinary photographs without ropes, or a folder of
labelled photographs, are given to the detector of `lariat see`. What it finds is compared with the
labels, and its doubt with the share of answers that are wrong.
"""

from __future__ import annotations

import glob
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import skimage.data
from jaxtyping import UInt8

from benchmarks.perception.instances import calibration
from benchmarks.perception.instances.judgement import Judgement, judge
from benchmarks.perception.instances.reliability import draw_reliability
from benchmarks.perception.pictures.generators import Ground, rendered_picture
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.configuration import ConfigurationError
from lariat.perception.image import detector
from lariat.perception.image.p_wrong import DOUBTFUL

CABLE_COUNTS = (1, 2, 3)
"""Numbers of cables in the rendered pictures."""
GROUNDS: tuple[Ground, ...] = ("plain", "clutter", "real")
"""Grounds of the rendered pictures."""
WITHOUT_ROPE = (
    *("brick", "coins", "page", "cat", "grass", "gravel", "text", "clock", "moon", "astronaut"),
    *("coffee", "hubble_deep_field"),
)
"""Photographs of scikit-image without a rope: for judging only, nothing is fitted to them."""
FIRST_FIT_SEED, FIRST_EMPTY_SEED = 100_000, 200_000
"""First seeds of the pictures for the fit, and of those without cables; figures use lower ones."""
FIT_COUNTS = (1, 2, 0, 3)
"""Numbers of cables of the pictures for the fit, in turn."""
LABEL_SUFFIX = ".labels.png"
"""Ending of the file with the labels of a photograph."""
MASK_SUFFIX = "_mask_*.png"
"""Ending of the files with the masks of its cables, where there are no labels."""


class Trial(NamedTuple):
    """Picture that was looked at."""

    row: str
    """Row of the table that it belongs to."""
    judgement: Judgement
    """Comparison with its labels."""
    ms: float
    """Processor time [ms]."""


def run(
    pictures: int = 40,
    seed: int = 0,
    only: tuple[str, ...] = (),
    photographs: Path | None = None,
    diagram: Path | None = None,
    fit: int = 0,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Measure the detection of several ropes in single pictures, and whether its doubt is true.

    The folder of photographs holds `NAME.jpg` (or .png) and for each picture either
    `NAME.labels.png` (8 bits, 0 at the background, k at cable k, from 1 without gaps) or
    `NAME_mask_0.png`, `NAME_mask_1.png` and so on, one for each cable.

    Examples:
      lariat bench perception instances --only plain 3 --pictures 100
      lariat bench perception instances --photographs ~/cables
      lariat bench perception instances --fit 120 --photographs ~/cables --diagram doubt.png

    Args:
        pictures: Number of rendered pictures for each row.
        seed: First seed of the rendered pictures.
        only: Ground or number of cables of the rows to measure; all rows by default.
        photographs: Folder of labelled photographs to measure in place of rendered pictures.
        diagram: Image file to write: stated doubt against the share of wrong answers.
        fit: Number of rendered pictures with seeds of their own; prints coefficients of the judge
            fitted to them and to the photographs, and what it states about those that it was not
            fitted to.
    """
    if fit:
        return _fitted(fit, photographs, diagram)
    source = _rendered(pictures, seed, only) if photographs is None else taken(photographs)
    trials = [_tried(*picture) for picture in source]
    if not trials:
        where = (
            f"no row has all of {', '.join(only)}; there are plain, clutter, real, 1, 2, 3, none"
        )
        if photographs is not None:
            where = f"{photographs}: no picture has its {LABEL_SUFFIX} or masks beside it"
        raise ConfigurationError(where)
    rows = [_figures(name, trials) for name in dict.fromkeys(t.row for t in trials)]
    if diagram is not None:
        draw_reliability([(t.judgement.doubt, not t.judgement.right) for t in trials], diagram)
    caption = (
        "Shares of pictures (right number of ropes, all right), of cables (one line; mean Dice), "
        "of wrong and right answers (doubted); no plant: the curves are drawn; ms: processor time."
    )
    options.publish(Result("rows", rows, caption))
    return 0


def _rendered(
    count: int, seed: int, only: tuple[str, ...]
) -> Iterator[tuple[str, UInt8[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w"]]]:
    """Rows, rendered pictures and labels."""
    for ground in GROUNDS:
        for cables in CABLE_COUNTS:
            if not set(only) <= {ground, str(cables)}:
                continue
            for k in range(count):
                picture = rendered_picture(seed + k, cables, ground)
                yield f"{ground}, {cables}", picture.color, picture.labels
    if set(only) <= {"none"}:
        for name in WITHOUT_ROPE:
            picture = getattr(skimage.data, name)()
            if picture.ndim == 2:
                picture = cv2.cvtColor(picture, cv2.COLOR_GRAY2RGB)
            yield "without rope", picture, np.zeros(picture.shape[:2], np.uint8)


def taken(
    folder: Path,
) -> Iterator[tuple[str, UInt8[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w"]]]:
    """Yield rows, pictures and labels of a folder of photographs, sorted by name.

    Those with masks are in rows by the first part of their name.

    Args:
        folder: Folder as for `run`.

    Raises:
        ValueError: A picture or its labels cannot be read, or differ in size.
    """
    for path in sorted(folder.iterdir()):
        labelled = path.with_name(path.stem + LABEL_SUFFIX)
        masks = sorted(folder.glob(glob.escape(path.stem) + MASK_SUFFIX))
        if not labelled.exists() and not masks:
            continue
        picture = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
        layers = [cv2.imread(str(p), cv2.IMREAD_GRAYSCALE) for p in masks or [labelled]]
        if picture is None or any(m is None or m.shape != picture.shape[:2] for m in layers):
            raise ValueError(f"{path}: picture and labels cannot be read or differ in size")
        labels = np.zeros(picture.shape[:2], np.uint8)
        for k, layer in enumerate(layers, 1):
            labels = np.where(np.asarray(layer) > 127, k, labels) if masks else np.asarray(layer)
        labels = labels.astype(np.uint8)
        row = path.stem.split("_")[0] if masks else str(labels.max())
        yield f"photographs, {row}", np.asarray(picture, np.uint8), labels


def _tried(
    row: str, picture: UInt8[np.ndarray, "h w 3"], labels: UInt8[np.ndarray, "h w"]
) -> Trial:
    started = time.process_time()
    detection = detector.detect_ropes(picture)
    ms = 1e3 * (time.process_time() - started)
    return Trial(row, judge(labels, detection), ms)


def _figures(name: str, trials: list[Trial]) -> dict[str, Any]:
    own = [t for t in trials if t.row == name]
    judged = [t.judgement for t in own]
    right = np.array([j.right for j in judged])
    doubted = np.array([j.doubt > DOUBTFUL for j in judged])
    return {
        "pictures": name,
        "count": len(own),
        "right_number": float(np.mean([j.right_number for j in judged])),
        "one_line": _mean(np.concatenate([j.one_line for j in judged])),
        "dice": _mean(np.concatenate([j.dice for j in judged])),
        "right": float(np.mean(right)),
        "wrong_doubted": float(np.mean(doubted[~right])) if np.any(~right) else 1.0,
        "right_doubted": float(np.mean(doubted[right])) if np.any(right) else 0.0,
        "ms_p50": float(np.median([t.ms for t in own])),
        "ms_p95": float(np.percentile([t.ms for t in own], 95)),
    }


def _mean(shares: np.ndarray) -> float:
    return float(np.mean(shares)) if len(shares) else 1.0


def _fitted(count: int, photographs: Path | None, diagram: Path | None) -> int:
    """Print coefficients of the judge, and what it states about pictures it was not fitted to."""
    rendered = []
    # Three more without cables for every four pictures.
    for k in range(count + 3 * count // 4):
        ground, cables, seed = GROUNDS[k % len(GROUNDS)], 0, FIRST_EMPTY_SEED + k - count
        if k < count:
            cables = FIT_COUNTS[(k // len(GROUNDS)) % len(FIT_COUNTS)]
            seed = FIRST_FIT_SEED + k
        print(f"\rpicture {k + 1}", end="", file=sys.stderr)
        picture = rendered_picture(seed, cables, ground)
        row = f"rendered, {ground}" if cables else "rendered, none"
        rendered.append(calibration.sample(row, picture.color, picture.labels))
    labelled = [] if photographs is None else list(taken(photographs))
    real = [calibration.sample(*p, complete=False) for p in labelled]
    print(file=sys.stderr)
    groups = [[s for s in group if s is not None] for group in (rendered, real)]
    # Photographs weigh as much as all rendered pictures.
    weighed = [(s, 1.0 / len(group)) for group in groups for s in group]
    order = np.random.default_rng(0).permutation(len(weighed))
    samples, weights = zip(*(weighed[k] for k in order), strict=True)
    stated = calibration.cross_validated(list(samples), list(weights))
    if diagram is not None:
        draw_reliability([(s.doubt, s.wrong) for s in stated], diagram)
    for row in sorted({s.row for s in stated}):
        own = [s for s in stated if s.row == row]
        wrong = [s.doubt > DOUBTFUL for s in own if s.wrong]
        right = [s.doubt > DOUBTFUL for s in own if not s.wrong]
        lines = f"{sum(s.one_line for s in own)} of {sum(s.cables for s in own)} cables one line"
        print(
            f"{row}: {lines}, {len(right)} of {len(own)} answers right, doubted {sum(right)}; "
            f"wrong ones doubted {sum(wrong)} of {len(wrong)}"
        )
    fitted = calibration.fit(samples, weights)
    for name in ("background", "rope", "image"):
        numbers = ", ".join(f"{c:.4f}" for c in getattr(fitted, name))
        print(f"{name.upper()}_COEFFICIENTS = ({numbers})")
    return 0
