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
from jaxtyping import UInt8, UInt16

from services.perception.markers import (
    QUIET,
    MarkerDetector,
    Sighting,
    SteadyPlacement,
    placed,
    without_markers,
)
from shared.geometry import poses
from shared.geometry.cameras import Camera
from shared.geometry.markers import marker_on, rise
from shared.geometry.obstacles import Obstacle

MOVED = 0.0008
"""Less is no motion but noise [m]."""
TURNED = math.radians(0.4)
CROOKED = 0.1
"""A tag whose corners are further from a square, as a part of its side, is none."""
SETTLED = 3
"""Sightings before a marker is believed."""
EVERY = 3
"""Frames between two searches: a third of the frames is often enough, and costs a third."""
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

    def __init__(self, marked: dict[int, Obstacle], sides: dict[int, float]) -> None:
        """
        Args:
            marked: Obstacles by the identity of their markers.
            sides: Of those markers [m].
        """
        self._marked, self._sides = marked, sides
        self._detector = MarkerDetector()
        self._steady = {identity: SteadyPlacement() for identity in marked}
        self._count = dict.fromkeys(marked, 0)
        self._frame = 0
        self._sightings: list[Sighting] = []

    def look(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        camera: Camera,
        obstacles: Sequence[Obstacle],
    ) -> tuple[UInt8[np.ndarray, "h w 3"], list[Move]]:
        """The image without its markers, and which obstacles are no longer where they were.

        Args:
            color: Red, green, blue.
            depth: [mm], 0 where nothing was measured.
            camera: That took both.
            obstacles: As they are thought to be.
        """
        moves: list[Move] = []
        if self._frame % EVERY == 0:
            self._sightings = self._detector.find(color)
            moves = self._moves(camera, {o.name: o for o in obstacles})
        self._frame += 1
        dark = without_markers(color, self._sightings)
        return self._without_plates(dark, depth, camera, obstacles), moves

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

    def _without_plates(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        camera: Camera,
        obstacles: Sequence[Obstacle],
    ) -> UInt8[np.ndarray, "h w 3"]:
        """Blackens the plates of known markers, which a rope across them keeps from being found.

        Only what lies on the plate: a rope above it is nearer to the camera.
        """
        identities = {o.name: identity for identity, o in self._marked.items()}
        for obstacle in obstacles:
            if obstacle.name not in identities:
                continue
            half = (0.5 + QUIET) * self._sides[identities[obstacle.name]]
            square = half * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], float)
            pixels, z = camera.project(marker_on(obstacle).apply(square))
            if np.any(z <= 0.0):
                continue
            x, y, w, h = cv2.boundingRect(np.rint(pixels).astype(np.int32))
            x, y, right, low = max(x, 0), max(y, 0), x + w, y + h
            part = depth[y:low, x:right]
            if part.size == 0:
                continue
            inside = np.zeros(part.shape, np.uint8)
            cv2.fillConvexPoly(inside, np.rint(pixels - (x, y)).astype(np.int32), 1)
            above = (part > 0) & (part < 1e3 * (float(np.min(z)) - RAISED))
            color[y:low, x:right][(inside > 0) & ~above] = 0
        return color
