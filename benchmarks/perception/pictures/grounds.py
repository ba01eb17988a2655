"""Grounds on which cables lie: plain surfaces, and clutter."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float32

from lariat.perception.lines.segmentation import Color

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


def printed(
    random: np.random.Generator, size: tuple[int, int], color: Color
) -> Float32[np.ndarray, "h w 3"]:
    """Return a printed picture: tiles of many colours, rubble, or drips and strokes of paint."""
    width, height = size
    kind = random.random()
    if kind < 0.3:
        # Cells of smooth noise with dark joints, from sand to stones.
        noise = _smooth_noise(random, size, float(np.exp(random.uniform(*np.log([1.5, 25.0])))))
        levels = noise * random.uniform(0.6, 2.0)
        joint = np.exp(-(((levels - np.rint(levels)) / random.uniform(0.05, 0.3)) ** 2))
        light = (
            1.0 + random.uniform(0.05, 0.35) * np.rint(levels) - random.uniform(0.0, 0.6) * joint
        )
        return np.clip(np.array(color) * light[..., None], 0.0, 255.0).astype(np.float32)
    if kind < 0.6:
        cells = random.integers(3, 16, 2)
        hue = random.uniform(0.0, 255.0, (*cells, 3)) * random.uniform(0.3, 1.0)
        face = cv2.resize(hue, size, interpolation=random.choice([cv2.INTER_NEAREST, 1]))
        period = np.array(size) / cells[::-1]
        rows, columns = np.mgrid[:height, :width]
        tilt = random.uniform(-0.5, 0.5, 2)
        face *= (1.0 + tilt[0] * (rows / period[1] % 1.0) + tilt[1] * (columns / period[0] % 1.0))[
            ..., None
        ]
        return np.clip(face, 0.0, 255.0).astype(np.float32)
    face = np.broadcast_to(np.array(color, np.float32), (height, width, 3)).copy()
    palette = random.uniform(10.0, 250.0, (5, 3))
    for _ in range(int(random.integers(30, 400))):
        way = np.cumsum(np.cumsum(random.normal(0.0, random.uniform(0.3, 4.0), (20, 2)), 0), 0)
        points = np.rint(way + random.uniform((0.0, 0.0), size)).astype(np.int32)
        ink = palette[int(random.integers(len(palette)))].tolist()
        cv2.polylines(face, [points], False, ink, int(random.integers(1, 6)), cv2.LINE_AA)
        spot = np.clip(points[-1], -99, 9999).tolist()
        cv2.circle(face, spot, int(random.integers(1, 9)), ink, -1, cv2.LINE_AA)
    return face


def boards(
    random: np.random.Generator, size: tuple[int, int], color: Color
) -> Float32[np.ndarray, "h w 3"]:
    """Return a table of wooden boards with seams, long grain and knots."""
    width, height = size
    upright = random.random() < 0.4
    long, across = (height, width) if upright else (width, height)
    face = np.broadcast_to(np.array(color, np.float32), (across, long, 3)).copy()
    grain = _smooth_noise(random, (max(2, long // 24), across), random.uniform(0.8, 2.0))
    grain = cv2.resize(grain, (long, across), interpolation=cv2.INTER_CUBIC)
    face *= 1.0 + random.uniform(0.02, 0.12) * grain[..., None]
    at = random.uniform(0.0, 80.0)
    while at < across:
        step = random.uniform(30.0, 220.0)
        tone = 1.0 + random.normal(0.0, 0.05)
        face[int(at) : int(at + step)] *= tone
        shade = random.uniform(0.3, 0.95) if random.random() < 0.8 else random.uniform(1.05, 1.3)
        start, stop = sorted(random.integers(-long // 2, 3 * long // 2, 2).tolist())
        seam = np.zeros((across, long), np.float32)
        ends = (start, round(at)), (stop, round(at + random.normal(0.0, 3.0)))
        cv2.line(seam, *ends, 1.0, int(random.integers(1, 7)), cv2.LINE_AA)
        seam = cv2.GaussianBlur(seam, (0, 0), random.uniform(0.5, 3.0))
        face *= 1.0 - (1.0 - shade) * seam[..., None]
        at += step
    for _ in range(int(random.integers(0, 4))):
        middle = random.integers((0, 0), (long, across)).tolist()
        axes = (int(random.integers(4, 16)), int(random.integers(4, 12)))
        knot = np.zeros((across, long), np.float32)
        thickness = int(random.choice([-1, 2, 4]))
        cv2.ellipse(knot, middle, axes, 0.0, 0.0, 360.0, 1.0, thickness, cv2.LINE_AA)
        knot = cv2.GaussianBlur(knot, (0, 0), random.uniform(0.7, 2.5))
        face *= 1.0 - random.uniform(0.2, 0.7) * knot[..., None]
    return np.ascontiguousarray(face.transpose(1, 0, 2) if upright else face)


def add_edges(random: np.random.Generator, picture: Float32[np.ndarray, "h w 3"]) -> None:
    """Let the ground end at edges of sheets and tables, with a shadow or a bright rim, in place."""
    height, width = picture.shape[:2]
    reach = 2.0 * float(np.hypot(height, width))
    for _ in range(int(random.integers(1, 4))):
        angle = random.choice([0.0, 0.5, 1.0, 1.5]) * np.pi + random.normal(0.0, 0.12)
        ahead = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-ahead[1], ahead[0]])
        near = np.array([width, height]) / 2.0 + across * random.uniform(0.2, 0.6) * height
        corners = [near - reach * ahead, near + reach * ahead]
        corners += [corners[1] + reach * across, corners[0] + reach * across]
        mask = np.zeros((height, width), np.float32)
        cv2.fillPoly(mask, [np.rint(corners).astype(np.int32)], 1.0, cv2.LINE_AA)
        wide = random.uniform(1.0, 12.0)
        rim = cv2.GaussianBlur(mask, (0, 0), wide) * (1.0 - mask)
        picture *= 1.0 - random.uniform(-0.3, 0.9) * rim[..., None]
        color = random.uniform(5.0, 250.0, 3)
        other = plain_ground(random, (width, height), color, random.uniform(0.0, 0.05))
        picture += mask[..., None] * (other - picture)


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
