"""Grounds on which cables lie: plain surfaces, and clutter."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float32

from lariat.perception.centerline.segmentation import Color

WOOD_PERIOD = 14.0
"""Distance of the rings in wood [pixels]."""


def plain_ground(
    random: np.random.Generator, size: tuple[int, int], color: Color, grain: float
) -> Float32[np.ndarray, "h w 3"]:
    """Return a surface of one colour under a light that falls off to one side.

    Args:
        random: Source of light and grain.
        size: Width and height [pixels].
        color: Colour in full light.
        grain: Standard deviation of the grain, relative to the colour [-].
    """
    width, height = size
    rows, columns = np.mgrid[-0.5 : 0.5 : height * 1j, -0.5 : 0.5 : width * 1j]
    slope = random.uniform(-0.3, 0.3, 2)
    vignette = random.uniform(0.0, 0.5)
    light = 1.0 + slope[0] * rows + slope[1] * columns - vignette * (rows**2 + columns**2)
    light += grain * _smooth_noise(random, size, random.uniform(0.8, 2.5))
    return (np.array(color, float) * light[..., None]).astype(np.float32)


def wood(
    random: np.random.Generator, size: tuple[int, int], color: Color
) -> Float32[np.ndarray, "h w 3"]:
    """Return a board with rings."""
    rows, columns = np.mgrid[: size[1], : size[0]]
    angle = random.uniform(0.0, np.pi)
    across = rows * np.cos(angle) + columns * np.sin(angle)
    wide = _smooth_noise(random, size, 40.0)
    rings = np.sin(across / random.uniform(0.6, 1.4) / WOOD_PERIOD * 6.28 + 2.0 * wide)
    fine = _smooth_noise(random, size, 1.0)
    light = 1.0 + random.uniform(0.03, 0.1) * rings + 0.03 * fine
    return (np.array(color, float) * light[..., None]).astype(np.float32)


def cloth(
    random: np.random.Generator, size: tuple[int, int], color: Color
) -> Float32[np.ndarray, "h w 3"]:
    """Return woven cloth with soft folds."""
    rows, columns = np.mgrid[: size[1], : size[0]]
    period = random.uniform(3.0, 7.0)
    weave = np.sin(6.28 * columns / period) * np.sin(6.28 * rows / period)
    folds = _smooth_noise(random, size, 50.0)
    light = 1.0 + 0.08 * weave + random.uniform(0.05, 0.15) * folds
    return (np.array(color, float) * light[..., None]).astype(np.float32)


def add_things(
    random: np.random.Generator, picture: Float32[np.ndarray, "h w 3"], count: int
) -> None:
    """Lay boards, discs and printed sheets on a ground, each with a soft shadow, in place."""
    height, width = picture.shape[:2]
    for _ in range(count):
        mask = np.zeros((height, width), np.float32)
        middle = random.uniform((0.0, 0.0), (width, height))
        kind = random.choice(["board", "disc", "sheet"])
        if kind == "disc":
            radius = random.uniform(0.03, 0.12) * width
            cv2.circle(
                mask, np.rint(middle).astype(int).tolist(), int(radius), 1.0, -1, cv2.LINE_AA
            )
        else:
            sides = random.uniform(0.08, 0.35, 2) * width
            box = cv2.boxPoints((middle.tolist(), sides.tolist(), float(random.uniform(0, 180))))
            cv2.fillPoly(mask, [np.rint(box).astype(np.int32)], 1.0, cv2.LINE_AA)
        shadow = cv2.GaussianBlur(np.roll(mask, (5, 4), (0, 1)), (0, 0), 4.0)
        picture *= 1.0 - 0.35 * shadow[..., None]
        color = random.uniform(20.0, 235.0, 3)
        face = np.broadcast_to(color, picture.shape).astype(np.float32).copy()
        if kind == "sheet":
            _print_text(random, face, middle)
        picture += mask[..., None] * (face - picture)


def _print_text(
    random: np.random.Generator, face: Float32[np.ndarray, "h w 3"], middle: np.ndarray
) -> None:
    ink = np.zeros(face.shape[:2], np.uint8)
    for line in range(-6, 7):
        words = "".join(random.choice(list("abcdefgh iklmnop rstu"), 24))
        place = (int(middle[0]) - 150, int(middle[1]) + 22 * line)
        cv2.putText(ink, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, 255, 1, cv2.LINE_AA)
    face += (ink / 255.0)[..., None] * (random.uniform(0.0, 90.0) - face)


def _smooth_noise(
    random: np.random.Generator, size: tuple[int, int], sigma: float
) -> Float32[np.ndarray, "h w"]:
    """Noise of standard deviation one that is smooth over a length [pixels]."""
    shrink = max(1.0, sigma / 3.0)
    small = (max(2, int(size[0] / shrink)), max(2, int(size[1] / shrink)))
    noise = random.standard_normal(small[::-1], np.float32)
    noise = cv2.GaussianBlur(noise, (0, 0), sigma / shrink)
    noise = cv2.resize(noise, size, interpolation=cv2.INTER_LINEAR)
    return noise / max(float(noise.std()), 1e-9)
