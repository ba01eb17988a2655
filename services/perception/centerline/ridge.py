"""From a strand of pixels to rays through the rope's axis and ranges to its surface."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, UInt16

from services.perception.centerline.segmentation import Region
from services.perception.centerline.skeleton import Strand

SMOOTHING = 5
"""Half the window of the skeleton's running mean [pixels]."""
WINDOW = 8
"""Half the window along a strand that a robust first depth is taken from [pixels]."""


@dataclass(frozen=True)
class Ridge:
    """The axis of a strand in the whole image."""

    pixels: Float64[np.ndarray, "k 2"]
    """Column and row, sub-pixel."""
    normals: Float64[np.ndarray, "k 2"]
    """Across the strand, in the image."""
    clear: Bool[np.ndarray, "k"]
    """False near crossings."""
    depth: Float64[np.ndarray, "k"]
    """Robust depth of the surface on the axis [m]; NaN where there is none nearby."""


def ridge(strand: Strand, region: Region, depth: UInt16[np.ndarray, "h w"], width: float) -> Ridge:
    """The sub-pixel axis of a strand.

    Args:
        strand: In the region's pixels.
        region: Brightness around it.
        depth: Of the whole image [mm].
        width: Of the rope [pixels].
    """
    path = _smoothed(strand.pixels)
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True) + 1e-12
    normals = np.stack([tangents[:, 1], -tangents[:, 0]], axis=1)
    reach = width / 2.0 + 2.5
    offsets = np.linspace(-reach, reach, 2 * int(2 * reach) + 1)
    around = path[:, None, :] + offsets[:, None] * normals[:, None, :]
    profile = cv2.remap(
        region.brightness,
        around[..., 0].astype(np.float32),
        around[..., 1].astype(np.float32),
        cv2.INTER_LINEAR,
    ).astype(float)
    # Of the profile only what rises above half the ridge counts: a bright neighbour must not pull.
    profile = np.maximum(profile - 0.4 * profile.max(axis=1, keepdims=True), 0.0)
    shift = (profile @ offsets) / np.maximum(profile.sum(axis=1), 1e-9)
    shift = np.clip(shift, -width / 2.0, width / 2.0)
    clear = strand.clear & (np.abs(shift) < 0.45 * width + 0.3)
    pixels = path + np.where(clear, shift, 0.0)[:, None] * normals
    pixels += np.array([region.left, region.top], float)
    return Ridge(pixels, normals, clear, _robust_depth(pixels, normals, depth))


def _smoothed(pixels: Float64[np.ndarray, "k 2"]) -> Float64[np.ndarray, "k 2"]:
    half = min(SMOOTHING, (len(pixels) - 1) // 2)
    if half < 1:
        return pixels
    # Mirrored through its ends, so that the mean does not shorten the strand.
    head = 2.0 * pixels[0] - pixels[half:0:-1]
    tail = 2.0 * pixels[-1] - pixels[-2 : -2 - half : -1]
    sums = np.cumsum(np.concatenate([np.zeros((1, 2)), head, pixels, tail]), axis=0)
    return (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)


def sampled(
    depth: UInt16[np.ndarray, "h w"], pixels: Float64[np.ndarray, "*b 2"]
) -> Float64[np.ndarray, "*b"]:
    """Depth of the nearest pixels [m]; 0 where nothing was measured or outside the image."""
    at = np.rint(pixels).astype(int)
    inside = (at >= 0).all(-1) & (at[..., 0] < depth.shape[1]) & (at[..., 1] < depth.shape[0])
    columns = np.clip(at[..., 0], 0, depth.shape[1] - 1)
    rows = np.clip(at[..., 1], 0, depth.shape[0] - 1)
    return np.where(inside, depth[rows, columns] / 1000.0, 0.0)


def _robust_depth(
    pixels: Float64[np.ndarray, "k 2"],
    normals: Float64[np.ndarray, "k 2"],
    depth: UInt16[np.ndarray, "h w"],
) -> Float64[np.ndarray, "k"]:
    across = np.array([-1.0, 0.0, 1.0])[:, None, None] * normals
    values = sampled(depth, pixels + across)
    values[values <= 0.0] = np.inf
    padded = np.pad(values, ((0, 0), (WINDOW, WINDOW)), constant_values=np.inf)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * WINDOW + 1, axis=1)
    ordered = np.sort(windows.transpose(1, 0, 2).reshape(len(pixels), -1), axis=1)
    count = np.isfinite(ordered).sum(axis=1)
    # Mixed pixels are always too far: a low quantile is nearer to the rope than the median.
    chosen = ordered[np.arange(len(pixels)), (0.35 * count).astype(int)]
    return np.where(count > 3, chosen, np.nan)
