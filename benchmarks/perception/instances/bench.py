"""Ropes as instances in single pictures: `lariat bench perception instances`.

Rendered pictures of the held-out generator, or a folder of labelled photographs, are given to the
detector of `lariat see`. What it finds is compared with the labels, and its doubt with the share
of answers that are wrong.
"""

from __future__ import annotations

import json as encoder
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from benchmarks.perception.instances import calibration
from benchmarks.perception.instances.judgement import Judgement, judge
from benchmarks.perception.instances.reliability import draw_reliability
from benchmarks.perception.pictures.generators import Ground, held_out_picture
from benchmarks.tables import report
from lariat.perception.image import detector
from lariat.perception.image.p_wrong import DOUBTFUL

CABLE_COUNTS = (1, 2, 3)
"""Numbers of cables in the rendered pictures."""
GROUNDS: tuple[Ground, Ground] = ("plain", "clutter")
"""Grounds of the rendered pictures."""
LABEL_SUFFIX = ".labels.png"
"""Ending of the file with the labels of a photograph."""


@dataclass(frozen=True)
class Trial:
    """Picture that was looked at."""

    row: str
    """Row of the table that it belongs to."""
    judgement: Judgement
    """Comparison with its labels."""
    ms: float
    """Processor time [ms]."""


@dataclass(frozen=True)
class RowFigures:
    """Row of the table."""

    pictures: str
    """Kind of pictures."""
    count: int
    """Number of pictures."""
    right_number: float
    """Share of the pictures with the right number of ropes [-]."""
    one_line: float
    """Share of the cables that one ordered line covers [-]."""
    dice: float
    """Mean Dice coefficient of the cables [-]."""
    right: float
    """Share of the pictures in which everything is right [-]."""
    wrong_doubted: float
    """Share of the wrong answers that are doubted [-]."""
    right_doubted: float
    """Share of the right answers that are doubted [-]."""
    ms_p50: float
    """Median processor time of a picture [ms]."""
    ms_p95: float
    """95th percentile of the processor time of a picture [ms]."""


def run(
    pictures: int = 40,
    seed: int = 0,
    only: tuple[str, ...] = (),
    photographs: Path | None = None,
    diagram: Path | None = None,
    fit: int = 0,
    json: bool = False,
) -> int:
    """Measure the detection of several ropes in single pictures, and whether its doubt is true.

    The folder of photographs holds `NAME.jpg` (or .png) and `NAME.labels.png` for each picture: 8
    bits, 0 at the background, k at cable k, from 1 without gaps.

    Examples:
      lariat bench perception instances --only plain 3 --pictures 100
      lariat bench perception instances --photographs ~/cables
      lariat bench perception instances --fit 160

    Args:
        pictures: Number of rendered pictures for each row.
        seed: First seed of the rendered pictures.
        only: Ground or number of cables of the rows to measure; all rows by default.
        photographs: Folder of labelled photographs to measure in place of rendered pictures.
        diagram: Image file to write: stated doubt against the share of wrong answers.
        fit: Number of pictures of the tuning generator; prints coefficients of the doubt fitted to
            them, and measures nothing.
        json: Print one JSON object instead of a table.
    """
    if fit:
        ropes, images = calibration.fit(fit)
        print(f"ROPE_COEFFICIENTS = {tuple(round(c, 4) for c in ropes)}")
        print(f"IMAGE_COEFFICIENTS = {tuple(round(c, 4) for c in images)}")
        return 0
    source = _rendered(pictures, seed, only) if photographs is None else _taken(photographs)
    trials = [_tried(*picture) for picture in source]
    if not trials:
        where = f"no row has all of {', '.join(only)}; there are plain, clutter, 1, 2, 3"
        if photographs is not None:
            where = f"{photographs}: no picture has its {LABEL_SUFFIX} beside it"
        print(where, file=sys.stderr)
        return 2
    rows = [_figures(name, trials) for name in dict.fromkeys(t.row for t in trials)]
    if diagram is not None:
        draw_reliability([t.judgement for t in trials], diagram)
    if json:
        print(encoder.dumps({"seed": seed, "rows": [vars(r) for r in rows]}))
        return 0
    caption = (
        "Shares of pictures, of cables and of answers; no plant: the curves are drawn; ms: "
        "processor time."
    )
    report(rows, caption)
    return 0


def _rendered(
    count: int, seed: int, only: tuple[str, ...]
) -> Iterator[tuple[str, UInt8[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w"]]]:
    """Rows, pictures and labels of the held-out generator."""
    for ground in GROUNDS:
        for cables in CABLE_COUNTS:
            if not set(only) <= {ground, str(cables)}:
                continue
            for k in range(count):
                picture = held_out_picture(seed + k, cables, ground)
                yield f"{ground}, {cables}", picture.color, picture.labels


def _taken(
    folder: Path,
) -> Iterator[tuple[str, UInt8[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w"]]]:
    """Rows, pictures and labels of a folder of photographs."""
    for path in sorted(folder.iterdir()):
        labelled = path.with_name(path.stem + LABEL_SUFFIX)
        if path.name.endswith(LABEL_SUFFIX) or not labelled.exists():
            continue
        picture = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
        labels = cv2.imread(str(labelled), cv2.IMREAD_GRAYSCALE)
        if picture is None or labels is None or labels.shape != picture.shape[:2]:
            raise ValueError(
                f"{path}: picture and {labelled.name} cannot be read or differ in size"
            )
        yield f"photographs, {labels.max()}", np.asarray(picture, np.uint8), labels.astype(np.uint8)


def _tried(
    row: str, picture: UInt8[np.ndarray, "h w 3"], labels: UInt8[np.ndarray, "h w"]
) -> Trial:
    started = time.process_time()
    try:
        found = detector.detect_ropes(picture)
    except ValueError:
        found = None
    return Trial(row, judge(labels, found), 1e3 * (time.process_time() - started))


def _figures(name: str, trials: list[Trial]) -> RowFigures:
    own = [t for t in trials if t.row == name]
    judged = [t.judgement for t in own]
    right = np.array([j.right for j in judged])
    doubted = np.array([j.doubt > DOUBTFUL for j in judged])
    return RowFigures(
        name,
        len(own),
        float(np.mean([j.right_number for j in judged])),
        float(np.mean(np.concatenate([j.one_line for j in judged]))),
        float(np.mean(np.concatenate([j.dice for j in judged]))),
        float(np.mean(right)),
        float(np.mean(doubted[~right])) if np.any(~right) else 1.0,
        float(np.mean(doubted[right])) if np.any(right) else 0.0,
        float(np.median([t.ms for t in own])),
        float(np.percentile([t.ms for t in own], 95)),
    )
