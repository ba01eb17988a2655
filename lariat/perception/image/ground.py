"""Ground of an image: the smooth surface that most of it shows, and what stands out from it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8

GRID = (64, 48)
"""Columns and rows of the grid on which the ground is fitted."""
ROUNDS = 12
"""Rounds of the robust fit."""
RESIDUAL_SCALE = 6.0
"""Colour distance at which a cell of the grid has half its weight [Lab]."""
START_SCALE = 40.0
"""The same in the first round; it shrinks to `RESIDUAL_SCALE` [Lab]."""
SIGMAS = 5.0
"""Distance from the ground, in standard deviations of its grain, above which a pixel stands out."""
MIN_DISTANCE = 9.0
"""Least distance from the ground above which a pixel stands out [Lab]."""
STRONG_SHARE = 0.8
"""Distance from the ground above which a pixel is distinct, relative to the one that divides all
that stand out into two classes [-]."""
MIN_GROUND_SHARE = 0.45
"""Share of the cells that must fit the ground for it to be one [-]."""
MAX_GRAIN = 9.0
"""Largest standard deviation of the ground's grain [Lab]."""


@dataclass(frozen=True)
class StandingOut:
    """Pixels that differ from the ground."""

    mask: UInt8[np.ndarray, "h w"]
    """1 where the image differs from the ground."""
    distance: Float32[np.ndarray, "h w"]
    """Distance from the ground [Lab]."""
    strong: Bool[np.ndarray, "h w"]
    """Whether it differs as much as the more distinct part of the mask does."""
    ground: Float32[np.ndarray, "h w 3"]
    """Colour of the ground at every pixel [Lab]."""
    share: float
    """Share of the image that shows the ground, 0..1."""


def stand_out(lab: UInt8[np.ndarray, "h w 3"]) -> StandingOut | None:
    """Return the pixels that differ from the ground; None when there is no common ground.

    Args:
        lab: Image in Lab, as OpenCV scales it, a few hundred pixels wide.
    """
    cells = cv2.resize(lab, GRID, interpolation=cv2.INTER_AREA).reshape(-1, 3).astype(float)
    basis = _basis(*GRID)
    middle = np.median(cells, axis=0)
    distance = np.linalg.norm(cells - middle, axis=1)
    ground = np.broadcast_to(middle, cells.shape)
    for k in range(ROUNDS):
        scale = max(RESIDUAL_SCALE, START_SCALE * 0.7**k)
        weight = 1.0 / (1.0 + (distance / scale) ** 2) ** 2
        # A constant first, then a plane, then a curved surface: outliers must not bend it.
        terms = basis[:, : 1 if k < 2 else 3 if k < 5 else basis.shape[1]]
        weighted = terms * weight[:, None]
        normal = weighted.T @ terms + 1e-6 * np.eye(terms.shape[1])
        ground = terms @ np.linalg.solve(normal, weighted.T @ cells)
        distance = np.linalg.norm(cells - ground, axis=1)
    share = float(np.mean(distance < 2.0 * RESIDUAL_SCALE))
    if share < MIN_GROUND_SHARE:
        return None
    size = (lab.shape[1], lab.shape[0])
    surface = ground.reshape(GRID[1], GRID[0], 3).astype(np.float32)
    whole = cv2.resize(surface, size, interpolation=cv2.INTER_CUBIC)
    smooth = cv2.GaussianBlur(lab, (0, 0), 0.7).astype(np.float32)
    away = np.linalg.norm(smooth - whole, axis=2)
    near = away[away < 4.0 * RESIDUAL_SCALE]
    # The length of a normal vector of three components has a median of 1.54 sigma.
    grain = float(np.median(near)) / 1.54
    if grain > MAX_GRAIN:
        return None
    mask = away > max(MIN_DISTANCE, SIGMAS * grain)
    # Between shadows and ropes, where there are both.
    levels = np.minimum(away[mask], 255.0).astype(np.uint8)
    strong = cv2.threshold(levels, 0, 255, cv2.THRESH_OTSU)[0] if len(levels) else 0.0
    return StandingOut(mask.view(np.uint8), away, away > STRONG_SHARE * strong, whole, share)


def _basis(columns: int, rows: int) -> Float64[np.ndarray, "k m"]:
    """Polynomials of the third degree on a grid."""
    y, x = np.mgrid[-1.0 : 1.0 : rows * 1j, -1.0 : 1.0 : columns * 1j]
    x, y = x.ravel(), y.ravel()
    powers = [(i, d - i) for d in range(4) for i in range(d, -1, -1)]
    return np.stack([x**i * y**j for i, j in powers], axis=1)


def thin_parts(
    mask: UInt8[np.ndarray, "h w"], width: float, widest: float
) -> Bool[np.ndarray, "h w"]:
    """Return the parts of a mask that are no wider than a rope.

    Args:
        mask: 1 at pixels that stand out.
        width: Width of the ropes [pixels].
        widest: Largest half width of a rope, or of a crossing of two [rope widths].
    """
    radii = cv2.distanceTransform(np.pad(mask, 1, mode="edge"), cv2.DIST_L2, 5)[1:-1, 1:-1]
    wide = (radii > max(widest * width, 2.5)).view(np.uint8)
    if not np.any(wide):
        return mask > 0
    from_wide = cv2.distanceTransform(1 - wide, cv2.DIST_L2, 5)
    return (mask > 0) & (from_wide > 1.6 * widest * width)
