"""Obstacles that carry a marker follow it.

The marker lies flat in the middle of its obstacle's upper face, its x axis along the obstacle's.
The obstacle's height is taken as believed: a marker says x, y and yaw.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8, UInt16

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.markers import marker_on, rise
from lariat.geometry.obstacles import Obstacle
from services.perception.markers.detection import (
    QUIET,
    MarkerDetector,
    Sighting,
    SteadyPlacement,
    placed,
    without_markers,
)

MOVED = 0.0008
"""Less is no motion but noise [m]."""
TURNED = math.radians(0.4)
CROOKED = 0.1
"""A tag whose corners are further from a square, as a part of its side, is none."""
SETTLED = 3
"""Sightings before a marker is believed."""
INTERVAL = 90_000_000
"""Between two searches [ns]: every third frame of 30 a second, which costs a third."""
WANDERED = 0.15
"""How far from its last place a plate is looked for that nobody sees [m]."""
WIDE = 1.7
"""What is so many times as wide as the rope is not the rope."""
RAISED = 0.006
"""What is so much nearer than a plate is no part of it [m]."""


@dataclass(frozen=True)
class Move:
    """Where a marked obstacle has been seen."""

    name: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]


class MarkedObstacles:
    """Watches the markers of a scenario's obstacles."""

    def __init__(
        self, marked: dict[int, Obstacle], sides: dict[int, float], rope_diameter: float
    ) -> None:
        """
        Args:
            marked: Obstacles by the identity of their markers.
            sides: Of those markers [m].
            rope_diameter: Of what else is bright [m].
        """
        self._marked, self._sides, self._rope_diameter = marked, sides, rope_diameter
        self._detector = MarkerDetector()
        self._steady = {identity: SteadyPlacement() for identity in marked}
        self._count = dict.fromkeys(marked, 0)
        self._searched: int | None = None
        self._sightings: list[Sighting] = []

    def look(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        stamp: int,
        camera: Camera,
        obstacles: Sequence[Obstacle],
    ) -> tuple[UInt8[np.ndarray, "h w 3"], list[Move]]:
        """The image without its markers, and which obstacles are no longer where they were.

        Args:
            color: Red, green, blue.
            depth: [mm], 0 where nothing was measured.
            stamp: Of both [ns].
            camera: That took both.
            obstacles: As they are thought to be.
        """
        moves: list[Move] = []
        if self._searched is None or not 0 <= stamp - self._searched < INTERVAL:
            self._searched = stamp
            self._sightings = self._detector.find(color)
            moves = self._moves(camera, {o.name: o for o in obstacles})
        dark = without_markers(color, self._sightings)
        seen = {s.identity for s in self._sightings}
        identities = {o.name: identity for identity, o in self._marked.items()}
        for obstacle in obstacles:
            identity = identities.get(obstacle.name)
            if identity is None:
                continue
            self._blacken_plate(dark, depth, camera, obstacle, self._sides[identity])
            if identity not in seen:
                self._blacken_face(dark, depth, camera, obstacle)
        return dark, moves

    def _moves(self, camera: Camera, now: dict[str, Obstacle]) -> list[Move]:
        moves = []
        for sighting in self._sightings:
            start = self._marked.get(sighting.identity)
            current = now.get(start.name) if start is not None else None
            if start is None or current is None:
                continue
            height = current.position[2]
            found = placed(sighting, camera, height + rise(current))
            if found is None or found.residual > CROOKED * found.side:
                continue
            steady = self._steady[sighting.identity].add(found)
            self._count[sighting.identity] += 1
            if self._count[sighting.identity] < SETTLED:
                continue
            turn = poses.exponential(np.array([0.0, 0.0, steady.yaw]))
            way = np.hypot(*(steady.position[:2] - np.array(current.position[:2])))
            yaw = poses.logarithm(
                poses.multiply(turn, poses.conjugate(np.array(current.orientation)))
            )
            if way > MOVED or np.linalg.norm(yaw) > TURNED:
                x, y = steady.position[:2].tolist()
                moves.append(Move(start.name, (x, y, height), tuple(turn.tolist())))
        return moves

    def _blacken_plate(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        camera: Camera,
        obstacle: Obstacle,
        side: float,
    ) -> None:
        """Blackens the plate of a known marker, which a rope across it keeps from being found.

        Only what lies on the plate: a rope above it is nearer to the camera.
        """
        half = (0.5 + QUIET) * side
        square = half * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], float)
        plate = marker_on(obstacle)
        pixels, z = camera.project(plate.apply(square))
        window = _window(pixels, z, depth.shape)
        if window is None:
            return
        part = depth[window]
        corner = (window[1].start, window[0].start)
        inside = np.zeros(part.shape, np.uint8)
        cv2.fillConvexPoly(inside, np.rint(pixels - corner).astype(np.int32), 1)
        face = _depth_at(plate.position[2], camera, window)
        above = (part > 0) & (1e-3 * part < face - RAISED)
        color[window][(inside > 0) & ~above] = 0

    def _blacken_face(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        camera: Camera,
        obstacle: Obstacle,
    ) -> None:
        """Blackens the plate of a marker that may have been moved while the rope hid it.

        It lies at the height that it always had, on a face that is wider than any rope.
        """
        centre = marker_on(obstacle).position
        square = WANDERED * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], float)
        pixels, z = camera.project(centre + square)
        window = _window(pixels, z, depth.shape)
        if window is None:
            return
        level = np.abs(1e-3 * depth[window] - _depth_at(centre[2], camera, window)) < RAISED
        width = camera.intrinsics.fx * self._rope_diameter / float(np.mean(z))
        size = 2 * round(0.5 * WIDE * width) + 1
        # Pixels without depth are no holes; then what is as narrow as a rope goes.
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


def _depth_at(
    height: float, camera: Camera, window: tuple[slice, slice]
) -> Float64[np.ndarray, "h w"]:
    """Depth of a horizontal plane at a height in part of an image [m]."""
    rows, columns = np.mgrid[window]
    rays = camera.rays(np.stack([columns, rows], axis=-1).reshape(-1, 2).astype(float))
    eye = camera.T_world_camera
    forward = poses.rotate(eye.orientation, np.array([0.0, 0.0, 1.0]))
    down = np.minimum(rays[:, 2], -1e-6)
    return ((height - eye.position[2]) / down * (rays @ forward)).reshape(rows.shape)
