"""Generator of labelled pictures, for figures and, with other seeds, for the judge's fit.

The network is trained on pictures of another generator, which shares the renderer and the kinds of
grounds alone.
"""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float64
from scipy.interpolate import CubicSpline

from benchmarks.perception.pictures import grounds
from benchmarks.perception.pictures.renderer import (
    Cable,
    LabelledPicture,
    Lighting,
    as_photograph,
    paint_cables,
)
from lariat.perception.lines.segmentation import Color

Ground = Literal["plain", "clutter", "real"]

PICTURE_SIZE = (896, 672)
"""Width and height: 0.6 megapixels [pixels]."""
MIN_BEND_RADIUS = 2.2
"""Least bend radius of an axis [widths]."""
MIN_GROUND_CONTRAST = 40.0
"""Least distance of a cable's colour from the ground's [Lab, as OpenCV scales it]."""
MIN_VISIBLE_LENGTH = 0.5
"""Least length of a cable within the picture [heights of the picture]."""
MIN_END_DISTANCE = 3.0
"""Least distance of a cable's end from all other cables [widths]: an end that touches another
cable is no end that anybody could tell."""
MIN_CROSSING_ANGLE = 0.35
"""Least angle between two axes where they are closer than a width [rad]."""
SAME_COLOR_SHARE = 0.35
"""Share of the pictures in which all cables have one colour [-]."""
SHEATHS: tuple[Color, ...] = (
    (222, 88, 140),
    (236, 200, 40),
    (40, 160, 160),
    (170, 30, 36),
    (28, 62, 140),
    (36, 120, 60),
    (232, 228, 220),
    (30, 30, 32),
    (206, 96, 30),
    (120, 84, 150),
    (150, 156, 160),
    (250, 170, 150),
)
"""Colours of sheaths."""
GROUNDS: tuple[Color, ...] = (
    (18, 18, 20),
    (40, 44, 48),
    (205, 205, 200),
    (236, 236, 232),
    (30, 90, 70),
    (120, 104, 88),
    (88, 110, 150),
)
"""Colours of the ground."""


def rendered_picture(seed: int, cable_count: int, ground: Ground) -> LabelledPicture:
    """Return a picture; some ranges of seeds have served for tuning.

    These are 5200 to 5319, 6100 to 6119, 7000 to 8039, and those from 100,000 on.
    """
    random = np.random.default_rng((2, seed))
    base = GROUNDS[int(random.integers(len(GROUNDS)))]
    width = random.uniform(7.0, 24.0)
    axes = _apart(random, cable_count, width)
    colors = _colors(random, cable_count, base)
    woven = random.random() < 0.5
    cables = []
    for k, (axis, color) in enumerate(zip(axes, colors, strict=True)):
        s = np.arange(len(axis)) / (8.0 * width)
        wave = 0.8 * np.sin(s + random.uniform(0.0, 6.28)) + np.linspace(0.0, 0.9, len(axis))
        height = 1.0 + (wave if woven else 1.2 * k + np.linspace(0.0, 1.0, len(axis)))
        own = width * random.uniform(0.85, 1.15)
        cables.append(Cable(axis, np.maximum(height, 0.0), own, color))
    azimuth = random.uniform(0.0, 6.28)
    lighting = Lighting(
        _unit(np.cos(azimuth), np.sin(azimuth), random.uniform(0.8, 2.0)),
        ambient=random.uniform(0.15, 0.7),
        gloss=random.uniform(30.0, 160.0),
        gloss_exponent=random.uniform(30.0, 120.0),
        shadow=random.choice([0.0, random.uniform(0.2, 0.5)]),
        shadow_blur=random.uniform(0.1, 0.4),
    )
    if ground == "plain":
        surface = grounds.plain_ground(random, PICTURE_SIZE, base, random.uniform(0.0, 0.05))
    elif ground == "real":
        makers = (grounds.boards, grounds.printed, grounds.cloth)
        surface = makers[int(random.integers(3))](random, PICTURE_SIZE, base)
        grounds.add_edges(random, surface)
    else:
        makers = (grounds.wood, grounds.cloth)
        surface = makers[int(random.integers(2))](random, PICTURE_SIZE, base)
        grounds.add_things(random, surface, int(random.integers(3, 9)))
    blur, motion = random.uniform(0.5, 1.3), random.uniform(0.0, 3.0)
    noise = random.uniform(2.0, 8.0)
    picture, labels = surface, np.zeros(surface.shape[:2], np.uint8)
    if cables:
        picture, labels = paint_cables(surface, cables, lighting)
    quality = int(random.integers(50, 95))
    color = as_photograph(picture, random, blur, motion, noise, quality)
    return LabelledPicture(color, labels, tuple(cables))


def _unit(x: float, y: float, z: float) -> tuple[float, float, float]:
    length = float(np.sqrt(x * x + y * y + z * z))
    return x / length, y / length, z / length


def _lab(color: Color) -> Float64[np.ndarray, "3"]:
    return cv2.cvtColor(np.array([[color]], np.uint8), cv2.COLOR_RGB2LAB)[0, 0].astype(float)


def _colors(random: np.random.Generator, count: int, ground: Color) -> list[Color]:
    """Colours that differ from the ground, and from each other unless all are the same."""
    same = random.random() < SAME_COLOR_SHARE
    chosen: list[Color] = []
    while len(chosen) < count:
        color = SHEATHS[int(random.integers(len(SHEATHS)))]
        if np.linalg.norm(_lab(color) - _lab(ground)) < MIN_GROUND_CONTRAST:
            continue
        if same and chosen:
            color = chosen[0]
        elif any(np.linalg.norm(_lab(color) - _lab(c)) < MIN_GROUND_CONTRAST for c in chosen):
            continue
        chosen.append(color)
    return chosen


def _apart(
    random: np.random.Generator, count: int, width: float
) -> list[Float64[np.ndarray, "k 2"]]:
    """Axes that a person could tell apart: no sharp bends, no end on a cable, no flat crossing."""
    axes: list[Float64[np.ndarray, "k 2"]] = []
    tries = 0
    while len(axes) < count:
        tries += 1
        if tries > 400:
            axes, tries = [], 0
        axis = _spline_axis(random)
        if _bend_radius(axis) < MIN_BEND_RADIUS * width or not _in_one_piece(axis, width):
            continue
        if _separable([*axes, axis], width):
            axes.append(axis)
    return axes


def _in_one_piece(axis: Float64[np.ndarray, "k 2"], width: float) -> bool:
    """Whether an axis is long enough in the picture, and does not come back into it."""
    size = np.array(PICTURE_SIZE)
    inside = ((axis > -width) & (axis < size + width)).all(axis=1)
    entries = np.count_nonzero(np.diff(inside.astype(int)) == 1) + int(inside[0])
    return entries == 1 and np.count_nonzero(inside) > MIN_VISIBLE_LENGTH * size[1]


def _bend_radius(axis: Float64[np.ndarray, "k 2"]) -> float:
    """Least bend radius of an axis whose points are a pixel apart [pixels]."""
    angle = np.unwrap(np.arctan2(*np.diff(axis, axis=0).T[::-1]))
    turning = np.abs(angle[10:] - angle[:-10]) / 10.0
    return 1.0 / max(float(np.max(turning)), 1e-9)


def _separable(axes: list[Float64[np.ndarray, "k 2"]], width: float) -> bool:
    """Whether ends lie free, and axes that are close cross at an angle."""
    step = max(2, int(width / 3.0))
    ahead = 4
    size = np.array(PICTURE_SIZE)
    thin = [a[::step] for a in axes]
    for i, a in enumerate(thin):
        for j, b in enumerate(thin[: i + 1]):
            gap = np.linalg.norm(a[:, None] - b[None], axis=2)
            if i == j:
                k = np.arange(len(a))
                gap[np.abs(k[:, None] - k[None]) * step < 5.0 * width] = np.inf
            ends = ((a[[0, -1]], gap[[0, -1]]), (b[[0, -1]], gap[:, [0, -1]].T))
            for points, near in ends:
                visible = ((points > -width) & (points < size + width)).all(axis=1)
                if np.any(visible & (near.min(axis=1) < MIN_END_DISTANCE * width)):
                    return False
            rows, columns = np.nonzero(gap < width)
            if len(rows) == 0:
                continue
            inside = ((a[rows] > -width) & (a[rows] < size + width)).all(axis=1)
            da = a[np.minimum(rows + ahead, len(a) - 1)] - a[np.maximum(rows - ahead, 0)]
            db = b[np.minimum(columns + ahead, len(b) - 1)] - b[np.maximum(columns - ahead, 0)]
            sine = np.abs(da[:, 0] * db[:, 1] - da[:, 1] * db[:, 0])
            sine /= np.linalg.norm(da, axis=1) * np.linalg.norm(db, axis=1)
            if np.any(inside & (sine < np.sin(MIN_CROSSING_ANGLE))):
                return False
    return True


def _spline_axis(random: np.random.Generator) -> Float64[np.ndarray, "k 2"]:
    """Axis through random points, from margin to margin or with a loop in it."""
    size = np.array(PICTURE_SIZE)
    count = int(random.integers(4, 7))
    angle = random.uniform(0.0, 6.28)
    way = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-way[1], way[0]])
    along = np.linspace(-0.5, 0.5, count) * random.uniform(0.7, 1.25) * float(size[0])
    points = size / 2.0 + along[:, None] * way
    points += random.normal(0.0, 0.16, (count, 1)) * float(size[1]) * across
    if random.random() < 0.25:
        # A loop: the next points go round a circle.
        at = int(random.integers(1, count - 1))
        radius = random.uniform(0.09, 0.16) * size[1]
        turn = np.linspace(0.0, 6.28, 7)[1:-1] * random.choice([-1.0, 1.0])
        circle = np.sin(turn)[:, None] * way + (1.0 - np.cos(turn))[:, None] * across
        points = np.concatenate([points[: at + 1], points[at] + radius * circle, points[at + 1 :]])
    chords = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    spline = CubicSpline(chords, points)
    return _pixel_steps(spline(np.linspace(0.0, chords[-1], 2000)))


def _pixel_steps(path: Float64[np.ndarray, "k 2"]) -> Float64[np.ndarray, "m 2"]:
    """Points of a path a pixel apart."""
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.arange(0.0, s[-1], 1.0)
    return np.stack([np.interp(at, s, path[:, k]) for k in (0, 1)], axis=1)
