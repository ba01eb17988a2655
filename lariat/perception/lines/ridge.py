"""Sub-pixel axis of a strand, and the depth of the rope's surface on it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, UInt16

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.perception.lines.segmentation import Region
from lariat.perception.lines.skeleton import Strand

SMOOTHING_HALF_WINDOW = 5
"""Half the window of the running mean over the skeleton [pixels]."""
DEPTH_HALF_WINDOW = 8
"""Half the window along a strand from which its robust depth is taken [pixels]."""
DEPTH_QUANTILE = 0.35
"""Quantile of the depths in that window: below the median, since mixed pixels are too far away."""
MIN_DEPTH_COUNT = 3
"""Number of depths in that window that must be exceeded for a robust depth."""
PROFILE_MARGIN = 2.5
"""Margin of the brightness profile beyond the rope's flanks [pixels]."""
PROFILE_FLOOR = 0.4
"""Share of a profile's peak that is subtracted, so that a bright neighbour does not attract it."""
MAX_SHIFT_WIDTHS, MAX_SHIFT_PIXELS = 0.45, 0.3
"""Shift of the ridge from the skeleton up to which a point is clear: [rope widths] + [pixels]."""


@dataclass(frozen=True)
class Ridge:
    """Axis of a strand in the whole image."""

    pixels: Float64[np.ndarray, "k 2"]
    """Column and row, with sub-pixel accuracy."""
    normals: Float64[np.ndarray, "k 2"]
    """Unit normals in the image."""
    clear: Bool[np.ndarray, "k"]
    """False near crossings."""
    depth: Float64[np.ndarray, "k"]
    """Robust depth of the surface on the axis [m]; NaN where none was measured nearby."""

    def part(self, run: slice) -> Ridge:
        """Return a part of it."""
        return Ridge(self.pixels[run], self.normals[run], self.clear[run], self.depth[run])


def extract_ridge(
    strand: Strand, region: Region, depth: UInt16[np.ndarray, "h w"], width: float
) -> Ridge:
    """Return the sub-pixel axis of a strand.

    Args:
        strand: Strand in pixels of the region.
        region: Likeness of the pixels around it.
        depth: Whole depth image [mm].
        width: Width of the rope [pixels].
    """
    path = _smoothed(strand.pixels)
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True) + 1e-12
    normals = np.stack([tangents[:, 1], -tangents[:, 0]], axis=1)
    reach = width / 2.0 + PROFILE_MARGIN
    offsets = np.linspace(-reach, reach, 2 * int(2 * reach) + 1)
    # Coordinate by coordinate, in a third of the time of pairs.
    columns, rows = (
        np.asarray(path[:, k, None] + offsets * normals[:, k, None], np.float32) for k in (0, 1)
    )
    profile = cv2.remap(region.likeness, columns, rows, cv2.INTER_LINEAR).astype(float)
    profile = np.maximum(profile - PROFILE_FLOOR * profile.max(axis=1, keepdims=True), 0.0)
    shift = (profile @ offsets) / np.maximum(profile.sum(axis=1), 1e-9)
    shift = np.clip(shift, -width / 2.0, width / 2.0)
    clear = strand.clear & (np.abs(shift) < MAX_SHIFT_WIDTHS * width + MAX_SHIFT_PIXELS)
    pixels = path + np.where(clear, shift, 0.0)[:, None] * normals
    pixels += np.array([region.left, region.top], float)
    return Ridge(pixels, normals, clear, _robust_depth(pixels, normals, depth))


def axis_points(
    ridge: Ridge, camera: Camera, radius: float, half_window: int
) -> Float64[np.ndarray, "k 3"]:
    """Return points near the axis of a ridge, with depth interpolated over gaps [m].

    Args:
        ridge: Ridge with at least one depth.
        camera: Camera of the image.
        radius: Distance of the axis behind the surface [m].
        half_window: Half the window over which depths are averaged [points].
    """
    measured = np.isfinite(ridge.depth)
    index = np.arange(len(measured))
    depth = np.interp(index, index[measured], ridge.depth[measured])
    half = min(half_window, (len(depth) - 1) // 2)
    padded = np.pad(depth, half, mode="edge")
    depth = np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), "valid")
    surface = camera.back_project(ridge.pixels, depth)
    return surface + radius * poses.normalized(camera.rays(ridge.pixels))


def sample_depth(
    depth: UInt16[np.ndarray, "h w"], pixels: Float64[np.ndarray, "*b 2"]
) -> Float64[np.ndarray, "*b"]:
    """Depth at the nearest pixels [m]; 0 where nothing was measured or outside the image.

    Args:
        depth: Depth image [mm].
        pixels: Columns and rows.
    """
    height, width = depth.shape
    columns, rows = (np.rint(pixels[..., k]).astype(int) for k in (0, 1))
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    if np.all(inside):
        return depth[rows, columns] / 1000.0
    near = depth[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
    return np.where(inside, near / 1000.0, 0.0)


def _smoothed(pixels: Float64[np.ndarray, "k 2"]) -> Float64[np.ndarray, "k 2"]:
    """Running mean along a strand, whose ends stay in place."""
    half = min(SMOOTHING_HALF_WINDOW, (len(pixels) - 1) // 2)
    if half < 1:
        return pixels
    # Mirrored through its ends, so that the mean does not shorten the strand.
    head = 2.0 * pixels[0] - pixels[half:0:-1]
    tail = 2.0 * pixels[-1] - pixels[-2 : -2 - half : -1]
    sums = np.cumsum(np.concatenate([np.zeros((1, 2)), head, pixels, tail]), axis=0)
    return (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)


def _robust_depth(
    pixels: Float64[np.ndarray, "k 2"],
    normals: Float64[np.ndarray, "k 2"],
    depth: UInt16[np.ndarray, "h w"],
) -> Float64[np.ndarray, "k"]:
    """Low quantile of the depths around each point of a ridge [m]."""
    across = np.array([-1.0, 0.0, 1.0])[:, None, None] * normals
    values = sample_depth(depth, pixels + across)
    values[values <= 0.0] = np.inf
    half = DEPTH_HALF_WINDOW
    padded = np.full((len(values), len(pixels) + 2 * half), np.inf)
    padded[:, half:-half] = values
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=1)
    ordered = np.sort(windows.transpose(1, 0, 2).reshape(len(pixels), -1), axis=1)
    count = np.isfinite(ordered).sum(axis=1)
    chosen = ordered[np.arange(len(pixels)), (DEPTH_QUANTILE * count).astype(int)]
    return np.where(count > MIN_DEPTH_COUNT, chosen, np.nan)
