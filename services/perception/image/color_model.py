"""What in a picture looks like one long thin thing, learnt from a part of it.

Colours inside the part and beside it make two histograms; the logarithm of their ratio says how
much every pixel of the picture looks like rope. Highlights, dark flanks and stripes are colours
like any other. What is far wider or thinner than the part was, or short, is dropped, and colours
are learnt anew from what is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8
from scipy.ndimage import gaussian_filter
from skimage.morphology import skeletonize

BITS = (5, 6, 6)
"""Of lightness and both chromas that the histograms tell apart."""
SPREAD = (0.8, 1.6, 1.6)
"""Smoothing of the histograms: light and sensor noise beyond what the part shows [cells]."""
RARE = 2e-6
"""Density of a colour that neither histogram knows."""
SUREST = 4.0
"""Where the logarithm of the ratio ends: no single pixel speaks louder than its neighbours."""
LEAST_RATIO = 0.8
"""From which on a pixel is rope: there is more background than rope."""
WIDEST, THINNEST = 1.35, 0.45
"""Half width over the rope's width, width over the rope's: other things have others."""
SHORTEST = 4.0
"""Length over width of a piece that is kept."""
MOSTLY = 0.5
"""Part of a mask's skeleton from which on it is not a rope with a shadow, but as dark as one."""
BESIDE = 1.4
"""Where what lies beside it is looked at, off the axis [widths]."""
SHADOW = (0.45, 0.93)
"""How dark a shadow is, against what lies beside it."""
SHADOW_TINT = 7.0
"""By how much its chroma may differ from that, in Lab."""


@dataclass(frozen=True)
class Piece:
    """A connected part of a ribbon."""

    label: int
    """In `cv2.connectedComponents` of its mask."""
    length: int
    """Of its skeleton [pixels]."""
    junctions: int
    """Places where its skeleton branches."""
    gap: float
    """Distance in Lab from the side that it is more like."""
    steady: float
    """Part of it that differs like the rest does, 0..1."""
    shadow: float
    """Part of it that could be a shadow of something else, 0..1."""


@dataclass(frozen=True)
class Ribbon:
    """Long thin pieces of one kind in a picture."""

    likeness: Float32[np.ndarray, "h w"]
    """Logarithm of how much likelier every pixel is rope than not."""
    mask: UInt8[np.ndarray, "h w"]
    """1 where it is taken for rope."""
    middle: Bool[np.ndarray, "h w"]
    """Its skeleton."""
    width: float
    """[pixels]."""


def learnt(lab: UInt8[np.ndarray, "h w 3"], part: UInt8[np.ndarray, "h w"]) -> Ribbon | None:
    """Everything that looks like a part of a picture; None when it does not look like rope.

    Args:
        lab: The picture in Lab, as OpenCV scales it.
        part: 1 on a piece of rope.
    """
    width, _ = measured(part)
    mask = _unshadowed(lab, part, width)
    likeness = _likeness(_cells(lab), mask, width)
    mask, middle, half = _cleaned((likeness > LEAST_RATIO).view(np.uint8), width)
    if not np.any(middle):
        return None
    return Ribbon(likeness, mask, middle, width_of(half[middle]))


def measured(mask: UInt8[np.ndarray, "h w"]) -> tuple[float, Bool[np.ndarray, "h w"]]:
    """Width of what is long and thin in a mask [pixels], and its skeleton."""
    middle = skeletonize(mask.view(bool))
    away = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    return width_of(away[middle]), middle


def width_of(half: Float32[np.ndarray, "k"]) -> float:
    """Width of what has these distances from its skeleton to the outside [pixels]."""
    # The distance reaches to the middle of the first pixel outside.
    return max(2.0 * float(np.median(half)) - 1.0, 1.5) if len(half) else 1.5


def contrasts(lab: UInt8[np.ndarray, "h w 3"], ribbon: Ribbon) -> list[Piece]:
    """The connected pieces of a ribbon, and how each differs from both of its sides."""
    rows, columns = np.nonzero(ribbon.middle)
    smooth = cv2.GaussianBlur(lab, (0, 0), max(0.5, 0.15 * ribbon.width)).astype(float)
    away = cv2.distanceTransform(ribbon.mask, cv2.DIST_L2, 5)
    field = cv2.GaussianBlur(away, (0, 0), max(1.0, 0.4 * ribbon.width))
    reach = BESIDE * ribbon.width * _across(field, rows, columns)
    here = smooth[rows, columns]
    _, labels = cv2.connectedComponents(ribbon.mask, connectivity=8)
    of = labels[rows, columns]
    forks = _junctions(ribbon.middle, round(ribbon.width) + 1)[rows, columns]
    sides = []
    for sign in (-1.0, 1.0):
        r = np.clip(np.rint(rows + sign * reach[:, 1]).astype(int), 0, lab.shape[0] - 1)
        c = np.clip(np.rint(columns + sign * reach[:, 0]).astype(int), 0, lab.shape[1] - 1)
        sides.append((smooth[r, c], ribbon.mask[r, c] == 0))
    found = []
    order = np.argsort(of, kind="stable")
    for on in np.split(order, np.flatnonzero(np.diff(of[order])) + 1):
        gaps, shadows, alike = [], [], []
        for beside, free in sides:
            seen = on[free[on]]
            if len(seen) < 0.2 * len(on):
                continue
            # Averaged along the piece, grain and noise cancel and the rope does not.
            away = here[seen] - beside[seen]
            gap = np.linalg.norm(np.mean(away, axis=0))
            gaps.append(float(gap))
            along = away @ np.mean(away, axis=0) / max(gap, 1e-9)
            alike.append(float(np.mean(along > 0.4 * gap)))
            shadows.append(float(np.mean(shadowed(here[seen], beside[seen]))))
        found.append(
            Piece(
                int(of[on[0]]),
                len(on),
                int(np.count_nonzero(forks[on])),
                min(gaps, default=0.0),
                min(alike, default=0.0),
                max(shadows, default=1.0),
            )
        )
    return found


def _junctions(middle: Bool[np.ndarray, "h w"], spur: int) -> Bool[np.ndarray, "h w"]:
    """One pixel of every place where a skeleton branches, spurs apart."""
    left = middle.view(np.uint8).copy()
    for _ in range(spur):
        left &= (_around(left) > 2).view(np.uint8)
    many = left & (_around(left) > 3).view(np.uint8)
    _, labels = cv2.connectedComponents(cv2.dilate(many, np.ones((5, 5), np.uint8)))
    single = np.zeros(middle.shape, bool)
    at = np.flatnonzero((labels * many).ravel())
    _, first = np.unique(labels.ravel()[at], return_index=True)
    single.ravel()[at[first]] = True
    return single


def _around(mask: UInt8[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w"]:
    """Pixels of a mask among every pixel and its eight neighbours."""
    border = cv2.BORDER_CONSTANT
    return cv2.boxFilter(mask, -1, (3, 3), normalize=False, borderType=border)


def _across(
    field: Float32[np.ndarray, "h w"], rows: np.ndarray, columns: np.ndarray
) -> Float64[np.ndarray, "k 2"]:
    """Unit vectors, column and row, across the ridge of a field."""
    xx = cv2.Sobel(field, cv2.CV_32F, 2, 0, ksize=3)[rows, columns].astype(float)
    yy = cv2.Sobel(field, cv2.CV_32F, 0, 2, ksize=3)[rows, columns].astype(float)
    xy = cv2.Sobel(field, cv2.CV_32F, 1, 1, ksize=3)[rows, columns].astype(float)
    # The direction in which the field bends down most.
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy) + np.pi / 2.0
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def shadowed(
    here: Float64[np.ndarray, "*k 3"], beside: Float64[np.ndarray, "*k 3"]
) -> Bool[np.ndarray, "*k"]:
    """Whether colours are those beside them, only darker."""
    ratio = here[..., 0] / np.maximum(beside[..., 0], 1.0)
    # Chroma shrinks with the light, if at all.
    tint = here[..., 1:] - 128.0 - ratio[..., None] * (beside[..., 1:] - 128.0)
    off = np.linalg.norm(tint, axis=-1)
    return (ratio > SHADOW[0]) & (ratio < SHADOW[1]) & (off < SHADOW_TINT)


def _unshadowed(
    lab: UInt8[np.ndarray, "h w 3"], mask: UInt8[np.ndarray, "h w"], width: float
) -> UInt8[np.ndarray, "h w"]:
    """A mask without the shadow along one side of it, unless all of it could be one."""
    step = max(1, int(width / 3.0))
    small = cv2.resize(lab, None, fx=1.0 / step, fy=1.0 / step, interpolation=cv2.INTER_AREA)
    outside = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5) > 0.8 * width + 1.0
    size = (small.shape[1], small.shape[0])
    free = cv2.resize(outside.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    sigma = 2.0 * width / step
    total = cv2.GaussianBlur(small.astype(np.float32) * free[..., None], (0, 0), sigma)
    table = total / np.maximum(cv2.GaussianBlur(free, (0, 0), sigma), 1e-3)[..., None]
    rows, columns = np.nonzero(mask)
    at = np.minimum(rows // step, size[1] - 1), np.minimum(columns // step, size[0] - 1)
    dark = shadowed(lab[rows, columns].astype(float), table[at].astype(float))
    count, labels = cv2.connectedComponents(mask, connectivity=8)
    of = labels[rows, columns]
    inner = skeletonize(mask.view(bool))[rows, columns]
    total = np.bincount(of[inner], minlength=count)
    shady = np.bincount(of[inner], dark[inner], minlength=count) > MOSTLY * total
    dark &= ~shady[of]
    if not np.any(dark):
        return mask
    core = mask.copy()
    core[rows[dark], columns[dark]] = 0
    # A highlight on a dark rope is as grey as a shadow, but has rope on both sides.
    reach = 2 * max(1, round(0.3 * width)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    return cv2.morphologyEx(core, cv2.MORPH_CLOSE, kernel) * mask


def _cells(lab: UInt8[np.ndarray, "h w 3"]) -> np.ndarray:
    """Where in a histogram every pixel counts."""
    cells = (lab[..., 0] >> (8 - BITS[0])).astype(np.int32) << (BITS[1] + BITS[2])
    # Chroma of pictures keeps to the middle half of its scale.
    a, b = (np.clip(lab[..., k].astype(np.int32) - 64, 0, 127) for k in (1, 2))
    return cells | (a >> (7 - BITS[1])) << BITS[2] | (b >> (7 - BITS[2]))


def _likeness(
    cells: np.ndarray, mask: UInt8[np.ndarray, "h w"], width: float
) -> Float32[np.ndarray, "h w"]:
    outer, inner = 2.5 * width + 3.0, 0.3 * width + 1.0
    away = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5)
    beside = (away > inner) & (away < outer)
    elsewhere = away >= outer
    rope = _density(cells[mask > 0])
    # What lies beside it must be told from it, and so must the rest of the picture.
    other = 0.6 * _density(cells[beside]) + 0.4 * _density(cells[elsewhere][::7])
    ratio = np.log((rope + RARE) / (other + RARE))
    ratio = np.clip(ratio, -SUREST, SUREST).astype(np.float32).ravel()
    return cv2.GaussianBlur(ratio[cells], (0, 0), max(0.6, 0.14 * width))


def _density(cells: np.ndarray) -> np.ndarray:
    count = np.bincount(cells, minlength=1 << sum(BITS)).astype(np.float32)
    shape = tuple(1 << b for b in BITS)
    return gaussian_filter(count.reshape(shape), SPREAD) / max(len(cells), 1)


def _cleaned(
    mask: UInt8[np.ndarray, "h w"], width: float
) -> tuple[UInt8[np.ndarray, "h w"], Bool[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """A mask without what is too wide, too thin or too short; its skeleton, its half widths."""
    away = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    wide = (away > max(WIDEST * width, 2.5)).view(np.uint8)
    if np.any(wide):
        from_wide = cv2.distanceTransform(1 - wide, cv2.DIST_L2, 5)
        mask = mask * (from_wide > 1.6 * width + 1.0)
        away = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    kept = stats[:, cv2.CC_STAT_AREA] > 0.7 * SHORTEST * width * THINNEST * width
    kept[0] = False
    mask = kept[labels].view(np.uint8)
    middle = skeletonize(mask.view(bool))
    on = labels[middle]
    length = np.bincount(on, minlength=count)
    half = np.bincount(on, away[middle], minlength=count) / np.maximum(length, 1)
    kept &= (length > SHORTEST * width) & (2.0 * half - 1.0 > THINNEST * width - 0.5)
    # A skeleton as long as its own width is a blob's.
    kept &= length > 2.0 * SHORTEST * half
    mask = kept[labels].view(np.uint8)
    return mask, middle & (mask > 0), away
