"""Where marked obstacles are: square ArUco tags lying flat at a known height.

A tag's distance is poorly known from its size alone (PnP is some 8 mm off at 0.9 m). Its height is
known when its obstacle stands on the table, and then the rays through its corners meet that plane.
Frames and patterns as in `lariat.geometry.markers`.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.markers import DICTIONARY
from lariat.geometry.poses import Pose

PATTERNS = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
EDGE_POINTS = 24
"""Places along a side at which its edge is sought."""
EDGE_REACH = 3.0
"""How far from the first guess an edge is sought [pixels]."""
EDGE_STEP = 0.25
"""Between two samples across an edge [pixels]."""
QUIET = 0.25
"""Width of the white border around a tag as a part of its side, masked with it."""

JUMP = 0.004
"""More than this is no noise of a tag's place [m]."""
SWING = math.radians(3.0)


@dataclass(frozen=True)
class Sighting:
    """One tag in one image."""

    identity: int
    corners: Float64[np.ndarray, "4 2"]
    """Column and row, clockwise from the upper left one [pixels]."""


@dataclass(frozen=True)
class Placement:
    """Where a tag lies in its plane."""

    position: Float64[np.ndarray, "3"]
    """Centre [m]."""
    yaw: float
    """Of its x axis about the world's z [rad]."""
    side: float
    """Length of its edges as seen [m]."""
    residual: float
    """Root mean square distance of its corners from those of a square [m]."""

    @property
    def pose(self) -> Pose:
        """The tag's frame in the world."""
        half = np.array([0.0, 0.0, self.yaw])
        return Pose(self.position, poses.exponential(half))


class MarkerDetector:
    """Finds tags in colour images."""

    def __init__(self) -> None:
        self._detector = cv2.aruco.ArucoDetector(PATTERNS, cv2.aruco.DetectorParameters())

    def find(self, color: UInt8[np.ndarray, "h w 3"]) -> list[Sighting]:
        """All tags, by identity."""
        grey = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)
        corners, identities, _ = self._detector.detectMarkers(grey)
        if identities is None:
            return []
        found = [
            Sighting(int(identity), _sharpened(grey, np.asarray(quad, float).reshape(4, 2)))
            for quad, identity in zip(corners, np.ravel(identities), strict=True)
        ]
        return sorted(found, key=lambda s: s.identity)


def _sharpened(
    grey: UInt8[np.ndarray, "h w"], corners: Float64[np.ndarray, "4 2"]
) -> Float64[np.ndarray, "4 2"]:
    """Corners as the crossings of lines through the sub-pixel edges of all four sides.

    Refining single corners leaves a fifth of a pixel and turns the tag by half a degree.
    """
    for _ in range(2):
        sides = np.roll(corners, -1, axis=0) - corners
        lengths = np.linalg.norm(sides, axis=1)
        if np.min(lengths) < 4.0 * EDGE_REACH:
            return corners
        normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / lengths[:, None]
        # Not near the corners, where the window would see the neighbouring side.
        along = np.linspace(0.12, 0.88, EDGE_POINTS)
        across = np.arange(-EDGE_REACH, EDGE_REACH + EDGE_STEP / 2.0, EDGE_STEP)
        points = corners[:, None] + along[:, None] * sides[:, None]
        around = points[:, :, None] + across[:, None] * normals[:, None, None]
        flat = around.reshape(4 * EDGE_POINTS, -1, 2).astype(np.float32)
        values = cv2.remap(grey, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR).astype(float)
        slope = np.maximum(np.diff(values, axis=1), 0.0)
        # Only the strongest slope of each profile: cells of the pattern lie inside.
        slope = np.where(slope > 0.3 * slope.max(axis=1, keepdims=True), slope, 0.0)
        middle = 0.5 * (across[1:] + across[:-1])
        shift = (slope @ middle) / np.maximum(slope.sum(axis=1), 1e-9)
        edges = points + shift.reshape(4, EDGE_POINTS, 1) * normals[:, None]
        lines = np.array([_line(side) for side in edges])
        matrices = np.stack([np.roll(lines[:, :2], 1, axis=0), lines[:, :2]], axis=1)
        offsets = np.stack([np.roll(lines[:, 2], 1), lines[:, 2]], axis=1)
        corners = np.linalg.solve(matrices, offsets[..., None])[..., 0]
    return corners


def _line(points: Float64[np.ndarray, "k 2"]) -> Float64[np.ndarray, "3"]:
    """Normal (a, b) and offset c of the line a u + b v = c through points, outliers left out."""
    normal, offset = _straight(points)
    for _ in range(2):
        away = np.abs(points @ normal - offset)
        normal, offset = _straight(points[away <= max(0.15, 2.0 * float(np.median(away)))])
    return np.array([*normal, offset])


def _straight(points: Float64[np.ndarray, "k 2"]) -> tuple[Float64[np.ndarray, "2"], float]:
    """Normal and offset of the line nearest to all points."""
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre)[2][1]
    return normal, float(normal @ centre)


def placed(sighting: Sighting, camera: Camera, height: float) -> Placement | None:
    """The tag in the horizontal plane at a height [m]; None when the camera cannot see its face."""
    rays = camera.rays(sighting.corners)
    eye = camera.T_world_camera.position
    # The tag faces up: its plane must lie below the camera and every ray go down.
    if eye[2] <= height or np.any(rays[:, 2] >= -1e-6):
        return None
    corners = eye + ((height - eye[2]) / rays[:, 2])[:, None] * rays
    centre = corners.mean(axis=0)
    flat = (corners - centre)[:, :2] @ np.array([1.0, 1j])
    # Clockwise from the upper left, as an image shows it, seen from above with x to the right.
    ideal = np.array([-1.0 + 1j, 1.0 + 1j, 1.0 - 1j, -1.0 - 1j]) / 2.0
    # Least squares over rotation and size at once: a complex factor.
    factor = np.vdot(ideal, flat) / np.vdot(ideal, ideal)
    residual = float(np.sqrt(np.mean(np.abs(flat - factor * ideal) ** 2)))
    return Placement(centre, float(np.angle(factor)), float(np.abs(factor)), residual)


def without_markers(
    color: UInt8[np.ndarray, "h w 3"], sightings: list[Sighting]
) -> UInt8[np.ndarray, "h w 3"]:
    """The image with every tag and its white border blackened: they are bright as rope is."""
    dark = color.copy()
    for sighting in sightings:
        centre = sighting.corners.mean(axis=0)
        grown = centre + (1.0 + 2.0 * QUIET) * (sighting.corners - centre)
        cv2.fillConvexPoly(dark, np.rint(grown).astype(np.int32), (0, 0, 0))
    return dark


class SteadyPlacement:
    """The median of the last placements of one tag: a jump must repeat itself to be believed."""

    def __init__(self, memory: int = 5) -> None:
        self._last: deque[Placement] = deque(maxlen=memory)

    def add(self, placement: Placement) -> Placement:
        """Takes one more and answers with the steady one."""
        if len(self._last) > 1:
            newest, before = self._last[-1], self._median()
            if not _near(placement, before) and not _near(newest, before):
                # Two in a row that are elsewhere: what was seen before that is history.
                self._last.clear()
                self._last.append(newest)
        self._last.append(placement)
        return self._median()

    def _median(self) -> Placement:
        newest, first = self._last[-1], self._last[0].yaw
        position = np.median([p.position for p in self._last], axis=0)
        turns = [math.remainder(p.yaw - first, 2.0 * math.pi) for p in self._last]
        yaw = math.remainder(first + float(np.median(turns)), 2.0 * math.pi)
        return Placement(position, yaw, newest.side, newest.residual)


def _near(one: Placement, other: Placement) -> bool:
    way = np.linalg.norm(one.position - other.position)
    return bool(way < JUMP and abs(math.remainder(one.yaw - other.yaw, 2.0 * math.pi)) < SWING)
