"""Detection of ropes in a single image of any camera: no calibration, no cell, no rope model.

The foreground is cut into fragments at its crossings, the fragments are joined to ropes by the
least total bending, and every rope is measured along its axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from services.perception.centerline.ridge import Ridge, extract_ridge
from services.perception.centerline.segmentation import Color, Region
from services.perception.centerline.skeleton import Strand
from services.perception.image.assembly import AssembledRope, assemble
from services.perception.image.color_model import ROPE_LOG_RATIO
from services.perception.image.flanks import center_between_flanks
from services.perception.image.foreground import Foreground, find_foreground
from services.perception.image.fragments import cut_fragments
from services.perception.image.width import width_from_radii

MIN_IMAGE_SIDE = 48
"""Least shorter side of an image [pixels]."""
LIKENESS_PER_LOG_RATIO = 31.0
"""Likeness per unit of the log likelihood ratio."""
MIN_LENGTH_WIDTHS = 6.0
"""Least length of a rope [rope widths]."""
MIN_RELATIVE_LENGTH = 0.06
"""Least length of a rope, relative to the image's longer side."""


@dataclass(frozen=True)
class DetectedRope:
    """Rope in an image."""

    color: Color
    """Colour of its axis in the light of the image."""
    width: float
    """Width [pixels]."""
    lines: list[Ridge]
    """Sub-pixel centrelines, in order along the rope."""


@dataclass(frozen=True)
class Detection:
    """Ropes in an image."""

    ropes: list[DetectedRope]
    """Ropes, longest first."""
    labels: UInt8[np.ndarray, "h w"]
    """0 at the background, k where rope k is seen, from 1."""
    likeness: UInt8[np.ndarray, "h w"]
    """Likeness of every pixel to a rope; 128 separates ropes and background."""
    shadow: float
    """Share of the ropes that could be a shadow, 0..1: the colours of their sides, only darker."""


def detect_ropes(color: UInt8[np.ndarray, "h w 3"], rope_color: Color | None = None) -> Detection:
    """Return the ropes in an image.

    Args:
        color: Red, green, blue.
        rope_color: Colour of the ropes; None: all that stand out.

    Raises:
        ValueError: Nothing in the image looks like a rope.
    """
    if min(color.shape[:2]) < MIN_IMAGE_SIDE:
        raise ValueError(
            f"the image has {color.shape[1]} x {color.shape[0]} pixels, too few for a rope; give "
            f"at least {MIN_IMAGE_SIDE} x {MIN_IMAGE_SIDE}"
        )
    foreground = find_foreground(color, rope_color)
    found = None if foreground is None else _detection(color, foreground)
    if found is not None:
        return found
    if rope_color is None:
        raise ValueError(
            "nothing in the image is long, thin and distinct from both of its sides; give the "
            "rope's colour, or an image in which it is larger or contrasts more with the table"
        )
    raise ValueError(
        f"nothing of the colour {list(rope_color)} in the image is long, thin and distinct from "
        "both of its sides; take a colour from the image itself, or give none"
    )


def _detection(color: UInt8[np.ndarray, "h w 3"], foreground: Foreground) -> Detection | None:
    """Ropes of a foreground; None when all are too short."""
    height, width = color.shape[:2]
    rope = foreground.rope
    smooth = cv2.GaussianBlur(foreground.lab, (0, 0), max(0.5, 0.2 * rope.width))
    smooth = smooth.astype(np.float32)
    fragments = cut_fragments(rope.skeleton, foreground.radii, smooth, rope.width)
    assembly = assemble(fragments, rope.mask, rope.width)
    longer = max(rope.mask.shape)
    least = max(MIN_LENGTH_WIDTHS * rope.width, MIN_RELATIVE_LENGTH * longer)
    kept = [r for r in assembly.ropes if len(r.points) > least]
    if not kept:
        return None
    likeness = 128.0 + LIKENESS_PER_LOG_RATIO * (rope.likelihood - ROPE_LOG_RATIO)
    likeness = np.clip(likeness, 0.0, 255.0).astype(np.uint8)
    # Likeness outside the mask and its margin must not attract the sub-pixel lines.
    likeness *= cv2.dilate(rope.mask, np.ones((5, 5), np.uint8))
    lab = cv2.GaussianBlur(foreground.lab, (0, 0), 0.7).astype(np.float32)
    ropes = [_measured(foreground, lab, likeness, r) for r in kept]
    labels = _labels(ropes, rope.mask.shape)
    scale = width / rope.mask.shape[1]
    size = (width, height)
    return Detection(
        [_scaled(r, scale) for r in ropes],
        cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST),
        cv2.resize(likeness, size, interpolation=cv2.INTER_LINEAR),
        foreground.kinds[0].shadow,
    )


def _measured(
    foreground: Foreground,
    smooth: Float32[np.ndarray, "h w 3"],
    likeness: UInt8[np.ndarray, "h w"],
    found: AssembledRope,
) -> DetectedRope:
    """Rope with its sub-pixel axis, width and colour."""
    seen = np.rint(found.points[found.clear]).astype(int)
    radii = foreground.radii[seen[:, 1], seen[:, 0]]
    width = width_from_radii(radii)
    points, clear = _to_tips(found, foreground.rope.mask, width)
    region, no_depth = Region(likeness, foreground.rope.mask, 0, 0), np.zeros((1, 1), np.uint16)
    line = extract_ridge(Strand(points, clear), region, no_depth, width)
    axis, width = center_between_flanks(smooth, line.pixels, line.normals, line.clear, width)
    line = replace(line, pixels=axis)
    red, green, blue = np.median(foreground.image[seen[:, 1], seen[:, 0]], axis=0)
    return DetectedRope((int(red), int(green), int(blue)), width, [line])


def _to_tips(
    found: AssembledRope, mask: UInt8[np.ndarray, "h w"], width: float
) -> tuple[Float64[np.ndarray, "k 2"], np.ndarray]:
    """Axis up to both tips of the rope, which a skeleton does not reach."""
    points, clear = found.points, found.clear
    for _ in range(2):
        reach = max(2, round(width))
        way = points[-1] - points[-min(reach, len(points))]
        way = way / max(float(np.linalg.norm(way)), 1e-9)
        ahead = points[-1] + np.arange(1, reach + 1)[:, None] * way
        at = np.rint(ahead).astype(int)
        inside = (at >= 0).all(axis=1) & (at[:, 0] < mask.shape[1]) & (at[:, 1] < mask.shape[0])
        on = inside & (mask[at[:, 1] * inside, at[:, 0] * inside] > 0)
        count = int(np.argmin(on)) if not np.all(on) else len(on)
        points = np.concatenate([points, ahead[:count]])[::-1]
        clear = np.concatenate([clear, np.zeros(count, bool)])[::-1]
    return points, clear


def _labels(
    ropes: list[DetectedRope], shape: tuple[int, ...]
) -> UInt8[np.ndarray, "h w"]:
    """Label of the nearest rope for every pixel within half a width of an axis."""
    nearest = np.full(shape, 0.5, np.float32)
    labels = np.zeros(shape, np.uint8)
    for k, rope in enumerate(ropes, 1):
        free = np.ones(shape, np.uint8)
        for line in rope.lines:
            points = np.rint(8.0 * line.pixels).astype(np.int32)[:, None]
            cv2.polylines(free, [points], False, 0, 1, cv2.LINE_8, 3)
        distance = cv2.distanceTransform(free, cv2.DIST_L2, 5) / rope.width
        closer = distance < nearest
        labels[closer] = k
        nearest[closer] = distance[closer]
    return labels


def _scaled(rope: DetectedRope, scale: float) -> DetectedRope:
    """Rope in an image that is larger by a factor."""
    # The centre of the first pixel is at zero in every size.
    lines = [
        Ridge((line.pixels + 0.5) * scale - 0.5, line.normals, line.clear, line.depth)
        for line in rope.lines
    ]
    return replace(rope, width=rope.width * scale, lines=lines)
