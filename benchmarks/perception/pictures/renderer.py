"""Renderer of cables as lit tubes, painted from the lowest sample to the highest.

Every cable is an axis in the image with a height above the ground. Where cables cross, the higher
one is seen and darkens the lower one beside it. Samples across a tube are shaded with the normals
of a cylinder. The picture is painted at twice its size and averaged, so that edges are as soft as
a camera's.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from lariat.geometry import polylines
from lariat.perception.lines.segmentation import Color

SUPERSAMPLING = 2
"""Samples of the painted picture in each direction of a pixel."""
SAMPLE_SPACING = 0.3
"""Distance of the painted samples, along and across [pixels]."""
CONTACT_REACH = 0.9
"""Distance from a crossing's axis at which the lower cable is lit again [widths of the upper]."""


@dataclass(frozen=True)
class Cable:
    """Cable in a picture."""

    axis: Float64[np.ndarray, "k 2"]
    """Columns and rows along it, evenly spaced; may leave the picture [pixels]."""
    height: Float64[np.ndarray, "k"]
    """Height above the ground, which decides what covers what [widths]."""
    width: float
    """Width [pixels]."""
    color: Color
    """Colour in full light."""
    stripes: Color | None = None
    """Colour of a stripe wound around it; None for a plain cable."""
    lay: float = 3.0
    """Length of a turn of the stripe: about one for the strands of a rope, long for a sheath of two
    colours [widths]."""


@dataclass(frozen=True)
class Lighting:
    """Light on the cables and on the ground."""

    direction: tuple[float, float, float]
    """Unit vector towards the light: right, down, towards the camera."""
    ambient: float
    """Share of the light that comes from everywhere [-]."""
    gloss: float
    """Brightness of a highlight [levels]."""
    gloss_exponent: float
    """Exponent of a highlight: large for a smooth, hard sheath [-]."""
    shadow: float
    """Darkening of the ground in the full shadow, 0..1 [-]."""
    shadow_blur: float
    """Standard deviation of the shadow's edge [widths]."""


@dataclass(frozen=True)
class LabelledPicture:
    """Picture of cables with the truth about it."""

    color: UInt8[np.ndarray, "h w 3"]
    """Red, green, blue."""
    labels: UInt8[np.ndarray, "h w"]
    """0 at the ground, k where cable k is seen, from 1."""
    cables: tuple[Cable, ...]
    """Cables; cable k has the label k + 1."""


def paint_cables(
    ground: Float32[np.ndarray, "h w 3"], cables: list[Cable], lighting: Lighting
) -> tuple[Float32[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w"]]:
    """Return the ground with cables on it, and their labels.

    Args:
        ground: Ground in the light of the scene [levels].
        cables: Cables, on top of each other by height.
        lighting: Light.
    """
    rows, columns = ground.shape[:2]
    lit = ground * (1.0 - lighting.shadow * _ground_shadow(ground, cables, lighting))[..., None]
    size = (columns * SUPERSAMPLING, rows * SUPERSAMPLING)
    picture = cv2.resize(lit, size, interpolation=cv2.INTER_LINEAR)
    labels = np.zeros(picture.shape[:2], np.uint8)
    painted = [_samples(cables, k, lighting) for k in range(len(cables))]
    height = np.concatenate([p.height for p in painted])
    order = np.argsort(height, kind="stable")
    at = np.concatenate([p.at for p in painted])[order]
    colors = np.concatenate([p.colors for p in painted])[order]
    label = np.concatenate([np.full(len(p.height), k + 1) for k, p in enumerate(painted)])[order]
    at = np.rint((at + 0.5) * SUPERSAMPLING - 0.5).astype(int)
    inside = (at >= 0).all(axis=1) & (at[:, 0] < size[0]) & (at[:, 1] < size[1])
    at, colors, label = at[inside], colors[inside], label[inside]
    # The last of several samples of a pixel stays: the highest.
    picture[at[:, 1], at[:, 0]] = colors
    labels[at[:, 1], at[:, 0]] = label
    small = cv2.resize(picture, (columns, rows), interpolation=cv2.INTER_AREA)
    return small, _most_frequent(labels, len(cables), (columns, rows))


def as_photograph(
    picture: Float32[np.ndarray, "h w 3"],
    random: np.random.Generator,
    blur: float,
    motion: float,
    noise: float,
    quality: int,
) -> UInt8[np.ndarray, "h w 3"]:
    """Return the picture as a camera would store it.

    Args:
        picture: Red, green, blue [levels].
        random: Source of the direction of motion and of noise.
        blur: Standard deviation of the lens's blur [pixels].
        motion: Way of the camera during the exposure [pixels].
        noise: Standard deviation of the noise at white [levels]; dark pixels have less.
        quality: Quality of the JPEG, 1..100.
    """
    picture = cv2.GaussianBlur(picture, (0, 0), blur)
    if motion >= 1.0:
        half = int(np.ceil(motion))
        kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
        angle = random.uniform(0.0, np.pi)
        way = 0.5 * motion * np.array([np.cos(angle), np.sin(angle)])
        ends = np.rint(16.0 * (half + np.array([-way, way]))).astype(int)
        cv2.line(kernel, ends[0].tolist(), ends[1].tolist(), 1.0, 1, cv2.LINE_AA, 4)
        picture = cv2.filter2D(picture, -1, kernel / kernel.sum())
    # Photon noise grows with the square root of the light; the read-out adds a constant.
    scale = noise * np.sqrt(0.15 + 0.85 * np.clip(picture, 0.0, 255.0) / 255.0)
    picture = picture + scale * random.standard_normal(picture.shape, np.float32)
    stored = np.clip(np.rint(picture), 0.0, 255.0).astype(np.uint8)[..., ::-1]
    data = cv2.imencode(".jpg", stored, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert image is not None
    return np.ascontiguousarray(image[..., ::-1], np.uint8)


def _most_frequent(
    labels: UInt8[np.ndarray, "h w"], count: int, size: tuple[int, int]
) -> UInt8[np.ndarray, "i j"]:
    """Label that covers most of each pixel of a smaller picture."""
    shares = [
        cv2.resize((labels == k).astype(np.float32), size, interpolation=cv2.INTER_AREA)
        for k in range(count + 1)
    ]
    return np.argmax(shares, axis=0).astype(np.uint8)


@dataclass(frozen=True)
class _Samples:
    at: Float64[np.ndarray, "n 2"]
    colors: Float32[np.ndarray, "n 3"]
    height: Float64[np.ndarray, "n"]


def _samples(cables: list[Cable], index: int, lighting: Lighting) -> _Samples:
    """Shaded samples of the upper half of a cable."""
    cable = cables[index]
    flat = np.column_stack([cable.axis, cable.height])
    count = int(polylines.length(np.pad(cable.axis, ((0, 0), (0, 1)))) / SAMPLE_SPACING) + 2
    fine = _resampled(flat, count)
    axis, height = fine[:, :2], fine[:, 2]
    along = np.gradient(axis, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
    half = cable.width / 2.0
    u = np.linspace(-1.0, 1.0, int(cable.width / SAMPLE_SPACING) + 2)
    up = np.sqrt(1.0 - u**2)
    light = np.array(lighting.direction)
    facing = u * (normals @ light[:2])[:, None] + up * light[2]
    bright = lighting.ambient + (1.0 - lighting.ambient) * np.clip(facing, 0.0, 1.0)
    # The viewer looks along the image's axis: the normal halfway to the light shines.
    middle = light + np.array([0.0, 0.0, 1.0])
    middle /= np.linalg.norm(middle)
    shine = np.clip(u * (normals @ middle[:2])[:, None] + up * middle[2], 0.0, 1.0)
    bright = bright * _contact_shade(cables, index, axis, height)[:, None]
    color = np.broadcast_to(np.array(cable.color, float), (*bright.shape, 3)).copy()
    if cable.stripes is not None:
        turn = np.arange(count)[:, None] * SAMPLE_SPACING / (cable.lay * cable.width) + 0.3 * u
        color[turn % 1.0 < 0.4] = cable.stripes
    color = color * bright[..., None]
    color += (lighting.gloss * shine**lighting.gloss_exponent)[..., None]
    at = axis[:, None] + half * u[:, None] * normals[:, None]
    total = height[:, None] * cable.width + half * up
    return _Samples(at.reshape(-1, 2), color.reshape(-1, 3).astype(np.float32), total.reshape(-1))


def _contact_shade(
    cables: list[Cable],
    index: int,
    axis: Float64[np.ndarray, "k 2"],
    height: Float64[np.ndarray, "k"],
) -> Float64[np.ndarray, "k"]:
    """Light that reaches each sample of an axis from between the cables above it, 0..1."""
    shade = np.ones(len(axis))
    step = max(1, int(cables[index].width / (3.0 * SAMPLE_SPACING)))
    some = slice(None, None, step)
    at = np.arange(len(axis))
    for upper in cables:
        stride = max(1, int(len(upper.axis) / 400))
        above = upper.axis[::stride]
        gap = np.linalg.norm(axis[some, None] - above[None], axis=2)
        covered = (gap < CONTACT_REACH * upper.width) & (
            upper.height[::stride][None] * upper.width
            > height[some, None] * cables[index].width + 0.5 * upper.width
        )
        depth = np.where(covered, 1.0 - gap / (CONTACT_REACH * upper.width), 0.0).max(axis=1)
        shade *= 1.0 - 0.5 * np.interp(at, at[some], depth)
    return shade


def _ground_shadow(
    ground: Float32[np.ndarray, "h w 3"], cables: list[Cable], lighting: Lighting
) -> Float32[np.ndarray, "h w"]:
    """Shadow of all cables on the ground, 0..1."""
    shadow = np.zeros(ground.shape[:2], np.float32)
    for cable in cables:
        one = np.zeros_like(shadow)
        away = -np.array(lighting.direction[:2]) / max(lighting.direction[2], 0.3)
        moved = cable.axis + (0.5 + cable.height[:, None]) * cable.width * away
        points = np.rint(8.0 * moved).astype(np.int32)[:, None]
        cv2.polylines(one, [points], False, 1.0, max(1, round(cable.width)), cv2.LINE_AA, 3)
        sigma = max(0.5, lighting.shadow_blur * cable.width)
        shadow = np.maximum(shadow, cv2.GaussianBlur(one, (0, 0), sigma))
    return shadow


def _resampled(points: Float64[np.ndarray, "k 3"], count: int) -> Float64[np.ndarray, "n 3"]:
    """Points at equal distances in the image along a polyline with heights."""
    steps = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, s[-1], count)
    return np.stack([np.interp(at, s, points[:, k]) for k in range(3)], axis=1)
