"""Obstacles that carry a marker follow it.

The marker lies flat in the middle of its obstacle's upper face, its x axis along the obstacle's.
The obstacle stands where the scenario has it in height: a marker says x, y and yaw.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8

from services.perception.markers import (
    MarkerDetector,
    SteadyPlacement,
    placed,
    without_markers,
)
from shared.geometry import poses
from shared.geometry.cameras import Camera
from shared.geometry.markers import rise
from shared.geometry.obstacles import Obstacle

MOVED = 0.002
"""Less is no motion but noise [m]."""
TURNED = math.radians(1.0)
CROOKED = 0.1
"""A tag whose corners are further from a square, as a part of its side, is none."""
SETTLED = 3
"""Sightings before a marker is believed."""


@dataclass(frozen=True)
class Move:
    """Where a marked obstacle has been seen."""

    name: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]


class MarkedObstacles:
    """Watches the markers of a scenario's obstacles."""

    def __init__(self, marked: dict[int, Obstacle]) -> None:
        """
        Args:
            marked: Obstacles by the identity of their markers.
        """
        self._marked = marked
        self._detector = MarkerDetector()
        self._steady = {identity: SteadyPlacement() for identity in marked}
        self._count = dict.fromkeys(marked, 0)

    def look(
        self, color: UInt8[np.ndarray, "h w 3"], camera: Camera, obstacles: Sequence[Obstacle]
    ) -> tuple[UInt8[np.ndarray, "h w 3"], list[Move]]:
        """The image without its markers, and which obstacles are no longer where they were.

        Args:
            color: Red, green, blue.
            camera: That took it.
            obstacles: As they are thought to be.
        """
        sightings = self._detector.find(color)
        now = {o.name: o for o in obstacles}
        moves = []
        for sighting in sightings:
            start = self._marked.get(sighting.identity)
            current = now.get(start.name) if start is not None else None
            if start is None or current is None:
                continue
            found = placed(sighting, camera, start.position[2] + rise(start))
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
                moves.append(Move(start.name, (x, y, start.position[2]), tuple(turn.tolist())))
        return without_markers(color, sightings), moves
