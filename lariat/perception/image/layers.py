"""Pixels of every rope, and who lies on top where two of them cross.

The upper rope shows its colour at a crossing; where both have one colour, its flanks run on through
the crossing, and the lower one's do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8

MIN_COLOR_DIFFERENCE = 18.0
"""Distance of the colours of two ropes above which the colour tells the upper one [Lab]."""
MIN_EVIDENCE = 0.1
"""Difference of the evidence for both ropes, relative to its sum, below which it is unknown."""
FLANK_REACH = 1.5
"""Distance from a flank in which its slope is taken [pixels]."""
INNER_SHARE = 0.8
"""Part of the other rope's half width in which an upper rope's flanks are sampled [-]."""
WINDOW_MARGIN = 2
"""Margin of the window in which a crossing is examined [pixels]."""
MIN_CROSSING_AREA = 0.3
"""Least area of a crossing, relative to the product of both widths [-]."""


@dataclass(frozen=True)
class Crossing:
    """Place where two ropes cross."""

    position: tuple[float, float]
    """Column and row of its middle [pixels]."""
    ropes: tuple[int, int]
    """Indices of the two ropes, the upper one first where it is known."""
    known: bool
    """Whether the image tells which rope is the upper one."""


@dataclass(frozen=True)
class RopeBand:
    """Axis, width and colour of a rope."""

    pixels: Float64[np.ndarray, "k 2"]
    """Columns and rows along the axis."""
    normals: Float64[np.ndarray, "k 2"]
    """Unit normals of the axis."""
    width: float
    """Width [pixels]."""
    color: Float64[np.ndarray, "3"]
    """Colour of its axis [Lab]."""


def layer_ropes(
    ropes: list[RopeBand], lab: Float32[np.ndarray, "h w 3"]
) -> tuple[UInt8[np.ndarray, "h w"], list[Crossing]]:
    """Return the rope that each pixel shows, counted from 1, and the crossings.

    Args:
        ropes: Ropes.
        lab: Slightly smoothed image in Lab.
    """
    shape = lab.shape[:2]
    distances = [_distance_from_axis(rope, shape) for rope in ropes]
    labels = np.zeros(shape, np.uint8)
    nearest = np.full(shape, np.inf, np.float32)
    for k, (rope, distance) in enumerate(zip(ropes, distances, strict=True), 1):
        relative = distance / rope.width
        here = (relative <= 0.5) & (relative < nearest)
        labels[here] = k
        nearest[here] = relative[here]
    crossings = []
    for i in range(len(ropes)):
        for j in range(i):
            both = (distances[i] <= ropes[i].width / 2.0) & (distances[j] <= ropes[j].width / 2.0)
            if not np.any(both):
                continue
            least = MIN_CROSSING_AREA * ropes[i].width * ropes[j].width
            count, parts, stats, centers = cv2.connectedComponentsWithStats(both.view(np.uint8))
            for k in range(1, count):
                if stats[k, cv2.CC_STAT_AREA] < least:
                    continue
                left, top, wide, high = stats[k, : cv2.CC_STAT_AREA].tolist()
                around = np.s_[
                    max(0, top - WINDOW_MARGIN) : top + high + WINDOW_MARGIN,
                    max(0, left - WINDOW_MARGIN) : left + wide + WINDOW_MARGIN,
                ]
                part = parts[around] == k
                near = [d[around] for d in distances]
                column, row = centers[k].tolist()
                evidence = _evidence(ropes, near, lab[around], part, centers[k], (i, j))
                upper, lower = (i, j) if evidence >= 0.0 else (j, i)
                labels[around][part] = upper + 1
                decided = abs(evidence) >= MIN_EVIDENCE
                crossings.append(Crossing((column, row), (upper, lower), decided))
    return labels, crossings


def _distance_from_axis(rope: RopeBand, shape: tuple[int, ...]) -> Float32[np.ndarray, "h w"]:
    """Distance of every pixel near a rope from its axis [pixels]; infinite beyond its tips."""
    at = np.rint(rope.pixels).astype(int)
    inside = (at >= 0).all(axis=1) & (at[:, 0] < shape[1]) & (at[:, 1] < shape[0])
    index = np.flatnonzero(inside)
    at = at[inside]
    far = np.full(shape, np.inf, np.float32)
    if len(at) == 0:
        return far
    reach = rope.width / 2.0 + 2.0
    low = np.maximum(at.min(axis=0) - int(reach) - 1, 0)
    high = np.minimum(at.max(axis=0) + int(reach) + 2, shape[::-1])
    free = np.ones((high - low)[::-1], np.uint8)
    free[at[:, 1] - low[1], at[:, 0] - low[0]] = 0
    coarse, nearest = cv2.distanceTransformWithLabels(
        free, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    point = np.zeros(len(at) + 1, int)
    point[nearest[at[:, 1] - low[1], at[:, 0] - low[0]]] = index
    rows, columns = np.nonzero(coarse < reach)
    k = point[nearest[rows, columns]]
    rows, columns = rows + low[1], columns + low[0]
    offset = np.stack([columns, rows], axis=1) - rope.pixels[k]
    normals = rope.normals[k]
    across = np.abs(np.sum(offset * normals, axis=1))
    along = np.abs(offset[:, 0] * normals[:, 1] - offset[:, 1] * normals[:, 0])
    end = (k == 0) | (k == len(rope.pixels) - 1)
    far[rows, columns] = np.where(end & (along > 1.0), np.inf, across)
    return far


def _evidence(
    ropes: list[RopeBand],
    distances: list[Float32[np.ndarray, "h w"]],
    lab: Float32[np.ndarray, "h w 3"],
    part: Bool[np.ndarray, "h w"],
    middle: Float64[np.ndarray, "2"],
    pair: tuple[int, int],
) -> float:
    """Evidence that the first rope of a pair is the upper one, -1 to 1.

    Distances, image and crossing are those of a window; the middle of the crossing is not.
    """
    first, second = (ropes[k] for k in pair)
    weights = np.array([0.5, 1.0, 1.0])
    if np.linalg.norm(weights * (first.color - second.color)) > MIN_COLOR_DIFFERENCE:
        color = np.median(lab[part], axis=0)
        one, two = (float(np.linalg.norm(weights * (color - r.color))) for r in (first, second))
        return (two - one) / max(one + two, 1e-9)
    across = cv2.Sobel(lab, -1, 1, 0)
    down = cv2.Sobel(lab, -1, 0, 1)
    strength = []
    for own, other in (pair, pair[::-1]):
        nearest = np.argmin(np.linalg.norm(ropes[own].pixels - middle, axis=1))
        normal = ropes[own].normals[nearest]
        # Only across the rope: highlights and flanks of the other one run along it.
        slope = np.linalg.norm(normal[0] * across + normal[1] * down, axis=2)
        flank = np.abs(distances[own] - ropes[own].width / 2.0) < FLANK_REACH
        flank &= distances[other] < INNER_SHARE * ropes[other].width / 2.0
        strength.append(float(np.mean(slope[flank])) if np.any(flank) else 0.0)
    return (strength[0] - strength[1]) / max(sum(strength), 1e-9)
