"""Mask of marker plates that the rope hides from detection, or that moved while it hid them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt16

from lariat.geometry.cameras import Camera, Picture
from lariat.geometry.markers import marker_pose
from lariat.geometry.obstacles import Obstacle
from lariat.perception.markers.marker_detection import BORDER_RATIO

UNIT_SQUARE = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], float)
"""Corners of a square of half side one, clockwise from the upper left."""


@dataclass(frozen=True)
class PlateMaskSettings:
    """Distinction of plates from the rope above or beside them."""

    search_radius: float = 0.15
    """Distance from its last place within which a plate that is not detected may lie [m]."""
    max_rope_widths: float = 1.7
    """Width above which a region at the plate's height is not the rope [rope widths]."""
    height_tolerance: float = 0.006
    """Depth difference above which a pixel does not show the plate [m]."""


class PlateMask:
    """Blackens plates of markers in images, and keeps the rope across them."""

    def __init__(self, rope_diameter: float, settings: PlateMaskSettings | None = None) -> None:
        """
        Args:
            rope_diameter: Diameter of the rope [m].
            settings: Distinction of plates from the rope.
        """
        self._rope_diameter = rope_diameter
        self._settings = settings or PlateMaskSettings()

    def mask_plate(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        camera: Camera,
        obstacle: Obstacle,
        side: float,
    ) -> None:
        """Blacken the plate of a marker at its obstacle's pose; a rope above it is nearer.

        Args:
            color: Image that is changed.
            depth: Depth image [mm].
            camera: Camera of both images.
            obstacle: Obstacle that carries the marker.
            side: Side of the marker [m].
        """
        half = (0.5 + BORDER_RATIO) * side
        plate = marker_pose(obstacle)
        pixels, z = camera.project(plate.apply(half * UNIT_SQUARE))
        window = _window(pixels, z, depth.shape)
        if window is None:
            return
        part = depth[window]
        corner = (window[1].start, window[0].start)
        inside = np.zeros(part.shape, np.uint8)
        cv2.fillConvexPoly(inside, np.rint(pixels - corner).astype(np.int32), 1)
        face = _plane_depth(plate.position[2], camera, window)
        above = (part > 0) & (1e-3 * part < face - self._settings.height_tolerance)
        color[window][(inside > 0) & ~above] = 0

    def mask_moved_plate(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        camera: Camera,
        obstacle: Obstacle,
    ) -> None:
        """Blacken faces at the plate's height near its last place that are wider than the rope.

        Args:
            color: Image that is changed.
            depth: Depth image [mm].
            camera: Camera of both images.
            obstacle: Obstacle at its last pose.
        """
        s = self._settings
        centre = marker_pose(obstacle).position
        pixels, z = camera.project(centre + s.search_radius * UNIT_SQUARE)
        window = _window(pixels, z, depth.shape)
        if window is None:
            return
        height_error = np.abs(1e-3 * depth[window] - _plane_depth(centre[2], camera, window))
        level = height_error < s.height_tolerance
        width = camera.intrinsics.fx * self._rope_diameter / float(np.mean(z))
        size = 2 * round(0.5 * s.max_rope_widths * width) + 1
        # Fill pixels without depth; then remove regions as narrow as the rope.
        level = cv2.morphologyEx(level.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3)))
        wide = cv2.morphologyEx(level, cv2.MORPH_OPEN, np.ones((size, size)))
        color[window][wide > 0] = 0


def _window(
    pixels: Float64[np.ndarray, "k 2"], z: Float64[np.ndarray, "k"], shape: tuple[int, int]
) -> tuple[slice, slice] | None:
    """Rows and columns of an image around some of its pixels; None where it does not show them."""
    if np.any(z <= 0.0):
        return None
    x, y, w, h = cv2.boundingRect(np.rint(pixels).astype(np.int32))
    rows, columns = slice(max(y, 0), min(y + h, shape[0])), slice(max(x, 0), min(x + w, shape[1]))
    if rows.stop <= rows.start or columns.stop <= columns.start:
        return None
    return rows, columns


def _plane_depth(
    height: float, camera: Camera, window: tuple[slice, slice]
) -> Float64[np.ndarray, "h w"]:
    """Depth of a horizontal plane at a height in part of an image [m]."""
    rows, columns = (np.arange(part.start, part.stop, dtype=float) for part in window)
    # What a ray rises over a depth of one is linear in column and row.
    first = np.stack([columns, np.full(len(columns), rows[0])], axis=1)
    second = np.stack([np.full(len(rows), columns[0]), rows], axis=1)
    along, down = camera.rays(first)[:, 2], camera.rays(second)[:, 2]
    rise = down[:, None] + (along - along[0])
    return (height - camera.T_world_camera.position[2]) / np.minimum(rise, -1e-6)
