"""Contrast between the components of a rope mask and the background on both of their sides."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, UInt8

SIDE_OFFSET_WIDTHS = 1.4
"""Distance from the axis at which the sides are sampled [rope widths]."""
MIN_SIDE_SHARE = 0.2
"""Share of a component's skeleton that must have a free side for that side to count."""
STEADY_CONTRAST = 0.4
"""Contrast of a point, relative to its component's mean, above which it counts as steady."""
SHADOW_BRIGHTNESS = (0.45, 0.93)
"""Range of a shadow's lightness, relative to that of the surface beside it."""
MAX_SHADOW_TINT = 7.0
"""Largest difference between the chroma of a shadow and of the surface beside it [Lab]."""


@dataclass(frozen=True)
class RopeMask:
    """Long thin regions of one kind in an image."""

    likelihood: Float32[np.ndarray, "h w"]
    """Log likelihood ratio of rope against background for every pixel."""
    mask: UInt8[np.ndarray, "h w"]
    """1 at rope pixels."""
    skeleton: Bool[np.ndarray, "h w"]
    """Skeleton of the mask."""
    width: float
    """Width of the rope [pixels]."""


@dataclass(frozen=True)
class Component:
    """Connected component of a rope mask."""

    label: int
    """Label in `cv2.connectedComponents` of the mask."""
    length: int
    """Length of its skeleton [pixels]."""
    junctions: int
    """Number of places where its skeleton branches."""
    contrast: float
    """Distance from the side that is more similar [Lab]."""
    steadiness: float
    """Share of its skeleton with at least `STEADY_CONTRAST` of its mean contrast, 0..1."""
    shadow: float
    """Share of its skeleton that could be a shadow, 0..1."""


def component_contrasts(lab: UInt8[np.ndarray, "h w 3"], rope: RopeMask) -> list[Component]:
    """Return the connected components of a mask with their contrasts to both sides.

    Args:
        lab: Image in Lab, as OpenCV scales it.
        rope: Mask of the same size.
    """
    rows, columns = np.nonzero(rope.skeleton)
    smooth = cv2.GaussianBlur(lab, (0, 0), max(0.5, 0.15 * rope.width)).astype(float)
    radii = cv2.distanceTransform(rope.mask, cv2.DIST_L2, 5)
    field = cv2.GaussianBlur(radii, (0, 0), max(1.0, 0.4 * rope.width))
    offset = SIDE_OFFSET_WIDTHS * rope.width * _normals(field, rows, columns)
    here = smooth[rows, columns]
    _, labels = cv2.connectedComponents(rope.mask, connectivity=8)
    component = labels[rows, columns]
    junctions = _junctions(rope.skeleton, round(rope.width) + 1)[rows, columns]
    sides = []
    for sign in (-1.0, 1.0):
        r = np.clip(np.rint(rows + sign * offset[:, 1]).astype(int), 0, lab.shape[0] - 1)
        c = np.clip(np.rint(columns + sign * offset[:, 0]).astype(int), 0, lab.shape[1] - 1)
        sides.append((smooth[r, c], rope.mask[r, c] == 0))
    found = []
    order = np.argsort(component, kind="stable")
    for on in np.split(order, np.flatnonzero(np.diff(component[order])) + 1):
        contrasts, shadows, steady = [], [], []
        for beside, free in sides:
            points = on[free[on]]
            if len(points) < MIN_SIDE_SHARE * len(on):
                continue
            # The mean along the component cancels grain and noise, but not the colour of the rope.
            difference = here[points] - beside[points]
            contrast = np.linalg.norm(np.mean(difference, axis=0))
            contrasts.append(float(contrast))
            along = difference @ np.mean(difference, axis=0) / max(contrast, 1e-9)
            steady.append(float(np.mean(along > STEADY_CONTRAST * contrast)))
            shadows.append(float(np.mean(could_be_shadow(here[points], beside[points]))))
        found.append(
            Component(
                int(component[on[0]]),
                len(on),
                int(np.count_nonzero(junctions[on])),
                min(contrasts, default=0.0),
                min(steady, default=0.0),
                max(shadows, default=1.0),
            )
        )
    return found


def could_be_shadow(
    here: Float[np.ndarray, "*k 3"], beside: Float[np.ndarray, "*k 3"]
) -> Bool[np.ndarray, "*k"]:
    """Return whether colours are darker shades of those beside them.

    Args:
        here: Colours in Lab.
        beside: Colours of the surface beside them in Lab.
    """
    ratio = here[..., 0] / np.maximum(beside[..., 0], 1.0)
    darkest, brightest = SHADOW_BRIGHTNESS
    tint, _ = tint_and_brightness(here, beside)
    return (ratio > darkest) & (ratio < brightest) & (tint < MAX_SHADOW_TINT)


def tint_and_brightness(
    here: Float[np.ndarray, "*k 3"], beside: Float[np.ndarray, "*k 3"]
) -> tuple[Float[np.ndarray, "*k"], Float[np.ndarray, "*k"]]:
    """Return the difference of chroma from a shade of the surface beside, and that of lightness.

    Args:
        here: Colours in Lab.
        beside: Colours of the surface beside them in Lab.
    """
    # Chroma shrinks with the light, if at all.
    ratio = here[..., :1] / np.maximum(beside[..., :1], 1.0)
    tint = here[..., 1:] - 128.0 - ratio * (beside[..., 1:] - 128.0)
    return np.linalg.norm(tint, axis=-1), here[..., 0] - beside[..., 0]


def _junctions(skeleton: Bool[np.ndarray, "h w"], spur: int) -> Bool[np.ndarray, "h w"]:
    """One pixel of every branching of a skeleton, after spurs of a given length are removed."""
    pruned = skeleton.view(np.uint8).copy()
    for _ in range(spur):
        pruned &= (_neighbourhood_count(pruned) > 2).view(np.uint8)
    many = pruned & (_neighbourhood_count(pruned) > 3).view(np.uint8)
    _, labels = cv2.connectedComponents(cv2.dilate(many, np.ones((5, 5), np.uint8)))
    single = np.zeros(skeleton.shape, bool)
    at = np.flatnonzero((labels * many).ravel())
    _, first = np.unique(labels.ravel()[at], return_index=True)
    single.ravel()[at[first]] = True
    return single


def _neighbourhood_count(mask: UInt8[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w"]:
    """Number of mask pixels among every pixel and its eight neighbours."""
    border = cv2.BORDER_CONSTANT
    return cv2.boxFilter(mask, -1, (3, 3), normalize=False, borderType=border)


def _normals(
    field: Float32[np.ndarray, "h w"], rows: np.ndarray, columns: np.ndarray
) -> Float64[np.ndarray, "k 2"]:
    """Unit vectors, column and row, across the ridge of a field."""
    xx = cv2.Sobel(field, cv2.CV_32F, 2, 0, ksize=3)[rows, columns].astype(float)
    yy = cv2.Sobel(field, cv2.CV_32F, 0, 2, ksize=3)[rows, columns].astype(float)
    xy = cv2.Sobel(field, cv2.CV_32F, 1, 1, ksize=3)[rows, columns].astype(float)
    # Direction of the most negative second derivative.
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy) + np.pi / 2.0
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)
