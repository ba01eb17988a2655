"""Visible segments of the rope in one frame, not yet ordered along the rope."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8, UInt16

from lariat.geometry import polylines
from lariat.geometry.cameras import Camera, Picture
from lariat.perception.centerline.estimate import RopeDimensions
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.perception.lines.ridge import Ridge, axis_points, extract_ridge
from lariat.perception.lines.segmentation import (
    ColorLikeness,
    Region,
    brightness,
    segment_rope,
)
from lariat.perception.lines.skeleton import trace_strands

LIKENESS_DEPTH_STRIDE = 8
"""Stride of the depth pixels from which the rope's share of the image is estimated [pixels]."""


@dataclass(frozen=True)
class Observation:
    """Segments of the rope in one frame."""

    region: Region
    depth: UInt16[np.ndarray, "h w"]
    """Depth image, corrected by whole millimetres of its bias [mm]."""
    width: float
    """Width of the rope [pixels]."""
    ridges: list[Ridge]
    """Axis of each segment in the image."""
    points: list[Float64[np.ndarray, "k 3"]]
    """Points along the axis of each segment [m]."""
    bias: float
    """Remaining bias of every depth, below a millimetre [m]."""

    def width_at(self, pixels: Float64[np.ndarray, "k 2"]) -> Float64[np.ndarray, "k"]:
        """Return the width of the region of rope pixels around points of its axis [pixels]."""
        at = np.rint(pixels - [self.region.left, self.region.top]).astype(int)
        column, row = np.clip(at, 0, np.array(self.region.mask.shape[::-1]) - 1).T
        return 2.0 * self._edge_distance[row, column].astype(float)

    @cached_property
    def _edge_distance(self) -> Float32[np.ndarray, "h w"]:
        """Distance of every pixel of the region from the nearest one that is not rope [pixels]."""
        return np.asarray(cv2.distanceTransform(self.region.mask, cv2.DIST_L2, 3), np.float32)


class FrameObserver:
    """Finds the segments of one rope in frames of one camera."""

    def __init__(self, camera: Camera, rope: RopeDimensions, settings: CenterlineSettings) -> None:
        self._camera, self._rope, self._settings = camera, rope, settings
        color = settings.rope_color
        self._color_likeness = ColorLikeness(color) if color is not None else None

    def observe(
        self, color: Picture, depth: UInt16[np.ndarray, "h w"], bias: float
    ) -> Observation | str:
        """Return the segments in a frame, or the reason why the rope is lost.

        Args:
            color: Red, green, blue.
            depth: Depth image [mm], 0 where nothing was measured.
            bias: Bias of every depth [m].
        """
        i, limits = self._camera.intrinsics, self._settings.frame
        if color.shape[:2] != (i.height, i.width) or depth.shape != (i.height, i.width):
            return (
                f"images are {color.shape[1]} x {color.shape[0]} and {depth.shape[1]} x "
                f"{depth.shape[0]}, but the calibration is for {i.width} x {i.height}"
            )
        whole = round(1e3 * bias)
        if whole:
            near = np.clip(depth.astype(np.int32) - whole, 0, 65535)
            depth = np.where(depth > 0, near, 0).astype(np.uint16)
        likeness = self._likeness(color, depth)
        region = segment_rope(likeness, self._settings.threshold)
        if region is None:
            return self._nothing_found(int(np.max(likeness)))
        width = self._width(depth, region)
        if width is None:
            return "no depth where the image shows the rope"
        share = float(np.mean(region.mask)) * region.mask.size / depth.size
        most = limits.max_area_ratio * self._rope_area(width) / depth.size
        if share > max(limits.max_image_share, most):
            return self._too_much_found(share)
        ridges = [extract_ridge(s, region, depth, width) for s in trace_strands(region.mask, width)]
        ridges = [r for r in ridges if np.any(np.isfinite(r.depth))]
        half = limits.depth_smoothing_half_window
        points = [axis_points(r, self._camera, self._rope.radius, half) for r in ridges]
        visible = sum(polylines.length(p) for p in points)
        if visible < limits.min_visible_share * self._rope.length:
            return f"only {1e3 * visible:.0f} mm of rope in view"
        return Observation(region, depth, width, ridges, points, bias - 1e-3 * whole)

    def _likeness(
        self, color: Picture, depth: UInt16[np.ndarray, "h w"]
    ) -> UInt8[np.ndarray, "h w"]:
        """Likeness of every pixel to the rope, 0..255."""
        if self._color_likeness is None:
            return brightness(color)
        sampled = depth[::LIKENESS_DEPTH_STRIDE, ::LIKENESS_DEPTH_STRIDE]
        far = float(np.median(sampled[sampled > 0])) / 1000.0 if np.any(sampled) else 1.0
        pixel = far / self._camera.intrinsics.fx
        return self._color_likeness(
            color, 2.0 * self._rope.radius * self._rope.length / pixel**2 / depth.size
        )

    def _rope_area(self, width: float) -> float:
        """Largest area of the rope in the image [pixels]."""
        return width**2 * self._rope.length / (2.0 * self._rope.radius)

    def _width(self, depth: UInt16[np.ndarray, "h w"], region: Region) -> float | None:
        """Width of the rope in the image [pixels]; None without depth."""
        limits, mask = self._settings.frame, region.mask
        rows = slice(region.top, region.top + mask.shape[0])
        part = depth[rows, region.left : region.left + mask.shape[1]]
        values = part[mask.view(bool)]
        values = values[values > 0]
        if len(values) < limits.min_depth_pixels:
            return None
        # NumPy's percentile takes ten times as long.
        rank = (len(values) - 1) * limits.near_percentile / 100.0
        k = int(rank)
        low, high = np.partition(values, (k, k + 1))[k : k + 2] / 1000.0
        near = float(low + (rank - k) * (high - low))
        return 2.0 * self._rope.radius * self._camera.intrinsics.fx / near

    def _too_much_found(self, share: float) -> str:
        color, threshold = self._settings.rope_color, self._settings.threshold
        if color is None:
            return (
                f"{100.0 * share:.0f} % of the image is brighter than {threshold}, far more than "
                "a rope: give sensing.rope_color, or a higher sensing.threshold"
            )
        return (
            f"{100.0 * share:.0f} % of the image looks like the rope's colour {list(color)}, far "
            "more than a rope: give another sensing.rope_color or a higher sensing.threshold"
        )

    def _nothing_found(self, brightest: int) -> str:
        color, threshold = self._settings.rope_color, self._settings.threshold
        dark = self._settings.frame.dark_threshold_ratio * threshold
        if color is None and brightest > dark:
            return (
                f"no pixel is brighter than {threshold}, the brightest has {brightest}: add "
                "light, or give a lower sensing.threshold"
            )
        if color is None:
            return f"no pixel is brighter than {threshold}"
        return f"no pixel looks like the rope's colour {list(color)} (threshold {threshold})"
