"""Detection of ArUco markers in colour images, with sub-pixel corners.

Frames and patterns as in `lariat.geometry.markers`.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from lariat.geometry.cameras import Picture
from lariat.geometry.markers import MARKER_DICTIONARY
from lariat.perception.lines.segmentation import brightness

ARUCO_DICTIONARY = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, MARKER_DICTIONARY))
"""ArUco dictionary of all markers."""
BORDER_RATIO = 0.25
"""Width of the white border around a marker, as a share of its side."""


@dataclass(frozen=True)
class EdgeRefinementSettings:
    """Sampling of the four edges of a marker."""

    points_per_side: int = 24
    """Number of points along a side at which its edge is located."""
    side_range: tuple[float, float] = (0.12, 0.88)
    """Range along a side, 0..1, that is sampled; adjacent sides disturb samples near corners."""
    reach: float = 3.0
    """Distance on both sides of the first guess within which the edge is searched [pixels]."""
    step: float = 0.25
    """Distance between two samples across an edge [pixels]."""
    min_gradient_ratio: float = 0.3
    """Gradient below which samples are ignored, relative to the strongest of their profile."""
    min_outlier_distance: float = 0.15
    """Distance from the fitted line up to which a point is never an outlier [pixels]."""
    rounds: int = 2
    """Number of refinements, each from the corners of the one before."""


@dataclass(frozen=True)
class MarkerDetection:
    """Marker in one image."""

    identity: int
    """Index of its pattern."""
    corners: Float64[np.ndarray, "4 2"]
    """Column and row, clockwise from the upper left corner [pixels]."""


class MarkerDetector:
    """Detects markers in colour images."""

    def __init__(self, settings: EdgeRefinementSettings | None = None) -> None:
        self._settings = settings or EdgeRefinementSettings()
        self._detector = cv2.aruco.ArucoDetector(ARUCO_DICTIONARY, cv2.aruco.DetectorParameters())

    def detect(self, color: Picture) -> list[MarkerDetection]:
        """Return all markers in an image, sorted by identity."""
        grey = brightness(color)
        corners, identities, _ = self._detector.detectMarkers(grey)
        if identities is None:
            return []
        detections = [
            MarkerDetection(
                int(identity),
                _refined_corners(grey, np.asarray(quad, float).reshape(4, 2), self._settings),
            )
            for quad, identity in zip(corners, np.ravel(identities), strict=True)
        ]
        return sorted(detections, key=lambda d: d.identity)


def mask_markers(color: Picture, detections: list[MarkerDetection]) -> Picture:
    """Return the image with all markers and their white borders black: both look like rope."""
    dark = color.copy()
    for detection in detections:
        centre = detection.corners.mean(axis=0)
        grown = centre + (1.0 + 2.0 * BORDER_RATIO) * (detection.corners - centre)
        cv2.fillConvexPoly(dark, np.rint(grown).astype(np.int32), (0, 0, 0))
    return dark


def _refined_corners(
    grey: UInt8[np.ndarray, "h w"],
    corners: Float64[np.ndarray, "4 2"],
    settings: EdgeRefinementSettings,
) -> Float64[np.ndarray, "4 2"]:
    """Corners as the intersections of lines through the sub-pixel edges of all four sides.

    Refining each corner on its own leaves errors of 0.2 pixels and 0.5 degrees of rotation.
    """
    s = settings
    for _ in range(s.rounds):
        sides = np.roll(corners, -1, axis=0) - corners
        lengths = np.linalg.norm(sides, axis=1)
        if np.min(lengths) < 4.0 * s.reach:
            return corners
        normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / lengths[:, None]
        along = np.linspace(*s.side_range, s.points_per_side)
        across = np.arange(-s.reach, s.reach + s.step / 2.0, s.step)
        points = corners[:, None] + along[:, None] * sides[:, None]
        around = points[:, :, None] + across[:, None] * normals[:, None, None]
        flat = around.reshape(4 * s.points_per_side, -1, 2).astype(np.float32)
        values = cv2.remap(grey, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR).astype(float)
        gradient = np.maximum(np.diff(values, axis=1), 0.0)
        strongest = gradient.max(axis=1, keepdims=True)
        gradient = np.where(gradient > s.min_gradient_ratio * strongest, gradient, 0.0)
        middle = 0.5 * (across[1:] + across[:-1])
        shift = (gradient @ middle) / np.maximum(gradient.sum(axis=1), 1e-9)
        edges = points + shift.reshape(4, s.points_per_side, 1) * normals[:, None]
        normals, offsets = _robust_lines(edges, s.min_outlier_distance)
        matrices = np.stack([np.roll(normals, 1, axis=0), normals], axis=1)
        offsets = np.stack([np.roll(offsets, 1), offsets], axis=1)
        corners = np.linalg.solve(matrices, offsets[..., None])[..., 0]
    return corners


def _robust_lines(
    points: Float64[np.ndarray, "s k 2"], min_outlier_distance: float
) -> tuple[Float64[np.ndarray, "s 2"], Float64[np.ndarray, "s"]]:
    """Normals (a, b) and offsets c of the lines a u + b v = c through points, without outliers."""
    normals, offsets = _least_squares_lines(points, np.ones(points.shape[:2]))
    count = points.shape[1]
    for _ in range(2):
        distance = np.abs(np.vecdot(points, normals[:, None]) - offsets[:, None])
        ordered = np.sort(distance, axis=1)
        median = 0.5 * (ordered[:, (count - 1) // 2] + ordered[:, count // 2])
        limit = np.maximum(min_outlier_distance, 2.0 * median)
        normals, offsets = _least_squares_lines(points, (distance <= limit[:, None]).astype(float))
    return normals, offsets


def _least_squares_lines(
    points: Float64[np.ndarray, "s k 2"], weights: Float64[np.ndarray, "s k"]
) -> tuple[Float64[np.ndarray, "s 2"], Float64[np.ndarray, "s"]]:
    """Normals and offsets of the lines nearest to weighted points."""
    centres = (weights[:, None] @ points)[:, 0] / weights.sum(axis=1)[:, None]
    u, v = np.moveaxis(points - centres[:, None], 2, 0)
    # Twice the angle of the axis of least inertia.
    twice = np.arctan2(2.0 * np.vecdot(u * v, weights), np.vecdot(u * u - v * v, weights))
    normals = np.stack([-np.sin(0.5 * twice), np.cos(0.5 * twice)], axis=1)
    return normals, np.vecdot(normals, centres)
