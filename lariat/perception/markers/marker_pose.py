"""Pose of a marker that lies flat at a known height.

The size of a marker alone determines its distance poorly (PnP is about 8 mm off at 0.9 m). The
height is known when its obstacle stands on the table; the rays through the corners then meet that
plane.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry.cameras import Camera
from lariat.perception.markers.marker_detection import MarkerDetection


@dataclass(frozen=True)
class MarkerPose:
    """Pose of a marker in a horizontal plane."""

    position: Float64[np.ndarray, "3"]
    """Centre [m]."""
    yaw: float
    """Rotation of its x axis about the world's z axis [rad]."""
    side: float
    """Length of its sides as seen [m]."""
    residual: float
    """Root mean square distance of its corners from those of a square [m]."""


def locate_marker(detection: MarkerDetection, camera: Camera, height: float) -> MarkerPose | None:
    """Return the pose of a marker in a horizontal plane; None when the camera cannot see its face.

    Args:
        detection: Corners in the image.
        camera: Camera of the image.
        height: Height of the plane [m].
    """
    rays = camera.rays(detection.corners)
    eye = camera.T_world_camera.position
    # The marker faces up: its plane must lie below the camera, and every ray must point down.
    if eye[2] <= height or np.any(rays[:, 2] >= -1e-6):
        return None
    corners = eye + ((height - eye[2]) / rays[:, 2])[:, None] * rays
    centre = corners.mean(axis=0)
    flat = (corners - centre)[:, :2] @ np.array([1.0, 1j])
    # Clockwise from the upper left as in an image, seen from above with x to the right.
    ideal = np.array([-1.0 + 1j, 1.0 + 1j, 1.0 - 1j, -1.0 - 1j]) / 2.0
    # Least squares over rotation and size together: a complex factor.
    factor = np.vdot(ideal, flat) / np.vdot(ideal, ideal)
    residual = float(np.sqrt(np.mean(np.abs(flat - factor * ideal) ** 2)))
    return MarkerPose(centre, float(np.angle(factor)), float(np.abs(factor)), residual)


@dataclass(frozen=True)
class MedianFilterSettings:
    """Length of the filter, and limits of the noise."""

    length: int = 5
    """Number of poses of which the median is taken."""
    max_noise_distance: float = 0.004
    """Distance between two positions above which the marker has moved [m]."""
    max_noise_angle: float = math.radians(3.0)
    """Angle between two yaws above which the marker has rotated [rad]."""


class MarkerPoseFilter:
    """Median of the last poses of one marker; a jump is accepted when the next pose confirms it."""

    def __init__(self, settings: MedianFilterSettings | None = None) -> None:
        self._settings = settings or MedianFilterSettings()
        self._last: deque[MarkerPose] = deque(maxlen=self._settings.length)

    def add(self, pose: MarkerPose) -> MarkerPose:
        """Take in one pose and return the median."""
        if len(self._last) > 1:
            newest, before = self._last[-1], self._median()
            if not self._near(pose, before) and not self._near(newest, before):
                # Two poses in a row are elsewhere: those before them are outdated.
                self._last.clear()
                self._last.append(newest)
        self._last.append(pose)
        return self._median()

    def _median(self) -> MarkerPose:
        newest, first = self._last[-1], self._last[0].yaw
        position = np.median([p.position for p in self._last], axis=0)
        turns = [math.remainder(p.yaw - first, 2.0 * math.pi) for p in self._last]
        yaw = math.remainder(first + float(np.median(turns)), 2.0 * math.pi)
        return MarkerPose(position, yaw, newest.side, newest.residual)

    def _near(self, one: MarkerPose, other: MarkerPose) -> bool:
        distance = np.linalg.norm(one.position - other.position)
        angle = abs(math.remainder(one.yaw - other.yaw, 2.0 * math.pi))
        return bool(
            distance < self._settings.max_noise_distance and angle < self._settings.max_noise_angle
        )
