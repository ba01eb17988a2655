"""Obstacles that follow their markers.

A marker lies flat in the middle of its obstacle's upper face, with its x axis along the obstacle's.
The obstacle's height is taken from the scene: a marker measures x, y and yaw.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt16

from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Picture
from lariat.geometry.markers import upper_face
from lariat.geometry.obstacles import Obstacle
from lariat.perception.markers.marker_detection import MarkerDetection, MarkerDetector, mask_markers
from lariat.perception.markers.marker_pose import MarkerPoseFilter, locate_marker
from lariat.perception.markers.plate_mask import PlateMask


@dataclass(frozen=True)
class MarkerObstacleSettings:
    """Period of the search, and acceptance of detections."""

    search_period: int = 90_000_000
    """Least time between two searches [ns]: every third frame at 30 Hz."""
    min_detections: int = 3
    """Number of detections that a marker needs before it moves its obstacle."""
    max_residual_ratio: float = 0.1
    """Distance of the corners from those of a square, over its side, above which a detection is
    rejected."""
    min_motion: float = 0.0008
    """Distance above which an obstacle has moved [m]."""
    min_rotation: float = math.radians(0.4)
    """Angle above which an obstacle has rotated [rad]."""


@dataclass(frozen=True)
class ObstacleMove:
    """New pose of an obstacle, measured at its marker."""

    name: str
    """Name of the obstacle."""
    position: tuple[float, float, float]
    """Position [m]."""
    orientation: tuple[float, float, float, float]
    """Orientation, wxyz."""


class MarkerObstacles:
    """Tracks the obstacles of a scenario that carry markers."""

    def __init__(
        self,
        marked: dict[int, Obstacle],
        sides: dict[int, float],
        rope_diameter: float,
        settings: MarkerObstacleSettings | None = None,
    ) -> None:
        """
        Args:
            marked: Obstacles by the identity of their markers.
            sides: Sides of those markers [m].
            rope_diameter: Diameter of the rope, which must not be masked [m].
            settings: Period of the search, and acceptance.
        """
        self._marked, self._sides = marked, sides
        self._settings = settings or MarkerObstacleSettings()
        self._plates = PlateMask(rope_diameter)
        self._detector = MarkerDetector()
        self._filters = {identity: MarkerPoseFilter() for identity in marked}
        self._count = dict.fromkeys(marked, 0)
        self._searched: int | None = None
        self._detections: list[MarkerDetection] = []

    @property
    def in_view(self) -> frozenset[str]:
        """Names of the obstacles whose markers were found in the last search."""
        obstacles = (self._marked.get(d.identity) for d in self._detections)
        return frozenset(obstacle.name for obstacle in obstacles if obstacle is not None)

    def update(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        stamp: int,
        camera: Camera,
        obstacles: Sequence[Obstacle],
    ) -> tuple[Picture, list[ObstacleMove]]:
        """Return the image without its markers, and the obstacles that have moved.

        Args:
            color: Red, green, blue.
            depth: Depth image [mm], 0 where nothing was measured.
            stamp: Time of the exposure [ns].
            camera: Camera of both images.
            obstacles: Obstacles of the scene.
        """
        moves: list[ObstacleMove] = []
        since = stamp - self._searched if self._searched is not None else -1
        if not 0 <= since < self._settings.search_period:
            self._searched = stamp
            self._detections = self._detector.detect(color)
            moves = self._moves(camera, {o.name: o for o in obstacles})
        dark = mask_markers(color, self._detections)
        seen = {d.identity for d in self._detections}
        identities = {o.name: identity for identity, o in self._marked.items()}
        for obstacle in obstacles:
            identity = identities.get(obstacle.name)
            if identity is None:
                continue
            self._plates.mask_plate(dark, depth, camera, obstacle, self._sides[identity])
            if identity not in seen:
                self._plates.mask_moved_plate(dark, depth, camera, obstacle)
        return dark, moves

    def _moves(self, camera: Camera, now: dict[str, Obstacle]) -> list[ObstacleMove]:
        s = self._settings
        moves = []
        for detection in self._detections:
            start = self._marked.get(detection.identity)
            current = now.get(start.name) if start is not None else None
            if start is None or current is None:
                continue
            height = current.position[2]
            location = locate_marker(detection, camera, height + upper_face(current))
            if location is None or location.residual > s.max_residual_ratio * location.side:
                continue
            steady = self._filters[detection.identity].add(location)
            self._count[detection.identity] += 1
            if self._count[detection.identity] < s.min_detections:
                continue
            turn = poses.exponential(np.array([0.0, 0.0, steady.yaw]))
            distance = np.hypot(*(steady.position[:2] - np.array(current.position[:2])))
            rotation = poses.logarithm(
                poses.multiply(turn, poses.conjugate(np.array(current.orientation)))
            )
            if distance > s.min_motion or np.linalg.norm(rotation) > s.min_rotation:
                x, y = steady.position[:2].tolist()
                moves.append(ObstacleMove(start.name, (x, y, height), tuple(turn.tolist())))
        return moves
