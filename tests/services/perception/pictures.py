"""Synthetic photographs of a glossy cable and its shadow on a table, compressed as JPEG."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from lariat.geometry import polylines
from lariat.perception.lines.segmentation import Color

WIDTH, HEIGHT = 960, 720
LIGHT = np.array([-0.5, -0.7])
"""Direction in the image from which light falls."""
TABLES: dict[str, Color] = {
    "wood": (176, 128, 80),
    "cloth": (60, 70, 110),
    "print": (238, 238, 238),
    "tiles": (205, 200, 190),
    "white": (232, 232, 228),
    "grey": (125, 125, 128),
}


@dataclass(frozen=True)
class CableAppearance:
    """Appearance of a cable."""

    color: Color
    stripes: Color | None = None
    """Colour of a stripe wound around it; None for a plain cable."""
    width: float = 12.0
    """Width [pixels]."""


def random_axis(seed: int) -> Float64[np.ndarray, "k 2"]:
    """Smooth random axis through the image, with a point every third of a pixel [pixels]."""
    random = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, 2000)
    angle = np.full_like(s, random.uniform(0.0, 6.28))
    for k in (1, 2, 3):
        angle += random.normal(0.0, 1.2 / k) * np.cos(np.pi * k * s + random.uniform(0.0, 3.0))
    path = np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
    low, high = path.min(axis=0), path.max(axis=0)
    size = np.array([WIDTH, HEIGHT])
    path = (path - (low + high) / 2.0) * float(np.min(0.75 * size / (high - low))) + size / 2.0
    flat = np.pad(path, ((0, 0), (0, 1)))
    return polylines.resample(flat, int(3.0 * polylines.length(flat)))[:, :2]


def render_photograph(
    axis: Float64[np.ndarray, "k 2"],
    appearance: CableAppearance | None,
    table: str,
    seed: int,
    over: UInt8[np.ndarray, "h w 3"] | None = None,
) -> UInt8[np.ndarray, "h w 3"]:
    """Image of a cable, or of its shadow alone, on a table or over another image."""
    random = np.random.default_rng(seed)
    picture = _table(table, random) if over is None else over.astype(np.float32)
    width = 12.0 if appearance is None else appearance.width
    shadow = np.zeros((HEIGHT, WIDTH), np.float32)
    points = np.rint(8.0 * (axis + 0.4 * width)).astype(np.int32)[:, None]
    cv2.polylines(shadow, [points], False, 1.0, round(width), cv2.LINE_AA, 3)
    picture *= 1.0 - 0.45 * cv2.GaussianBlur(shadow, (0, 0), 0.35 * width)[..., None]
    if appearance is not None:
        _draw(picture, axis, appearance)
    rows, columns = np.mgrid[0 : 1 : HEIGHT * 1j, 0 : 1 : WIDTH * 1j]
    corner = (rows - 0.5) ** 2 + (columns - 0.5) ** 2
    if over is None:
        tint = random.uniform(0.88, 1.12, 3)
        picture *= ((0.85 + 0.3 * rows) * (1.0 - 0.6 * corner))[..., None] * tint
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8) + random.normal(0.0, 4.0, picture.shape)
    data = cv2.imencode(".jpg", np.clip(picture, 0, 255), [cv2.IMWRITE_JPEG_QUALITY, 85])[1]
    image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert image is not None
    return np.asarray(image, np.uint8)


def _draw(
    picture: Float32[np.ndarray, "h w 3"],
    axis: Float64[np.ndarray, "k 2"],
    appearance: CableAppearance,
) -> None:
    along = np.gradient(axis, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
    # Samples across the cable in half pixels, shaded with the normals of a cylinder.
    u = np.linspace(-1.0, 1.0, int(2.0 * appearance.width))
    facing = u * (normals @ LIGHT)[:, None]
    upward = np.sqrt(1.0 - u**2)
    bright = 0.35 + 0.75 * np.clip(0.8 * facing + 0.75 * upward, 0.0, 1.0)
    gloss = 120.0 * np.clip(0.55 * facing + 0.83 * upward, 0.0, 1.0) ** 40
    color = np.broadcast_to(np.array(appearance.color, float), (*bright.shape, 3)).copy()
    if appearance.stripes is not None:
        turn = np.arange(len(axis))[:, None] / (9.0 * appearance.width) + 0.25 * u
        color[turn % 1.0 < 0.5] = appearance.stripes
    at = np.rint(axis[:, None] + 0.5 * appearance.width * u[:, None] * normals[:, None]).astype(int)
    picture[at[..., 1], at[..., 0]] = color * bright[..., None] + gloss[..., None]


def _table(name: str, random: np.random.Generator) -> Float32[np.ndarray, "h w 3"]:
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    noise = random.normal(size=(HEIGHT, WIDTH))
    grain = 0.6 * cv2.GaussianBlur(noise, (0, 0), 2)
    if name == "wood":
        wide = cv2.GaussianBlur(noise, (0, 0), sigmaX=60, sigmaY=4)
        grain = 0.1 * np.sin(rows / 12.0 + 2.5 * wide / wide.std())
    elif name == "cloth":
        grain += 0.12 * np.sin(columns) * np.sin(rows)
    picture = np.array(TABLES[name], float) * (1.0 + 0.2 * grain[..., None])
    if name == "tiles":
        picture[(rows % 220 < 7) | (columns % 220 < 7)] = (120.0, 115.0, 110.0)
    elif name == "print":
        page = np.zeros((HEIGHT, WIDTH), np.uint8)
        for line in range(12):
            words = "".join(random.choice(list("abcdefgh iklmnop rstu"), 60))
            place = (40, 50 + 56 * line)
            cv2.putText(page, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.9, 255, 2, cv2.LINE_AA)
        picture[page > 128] = 40.0
    return picture.astype(np.float32)
