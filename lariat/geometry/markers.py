"""Square markers (ArUco 4x4_50) and where they lie on obstacles.

A marker's frame has x to the right along its upper edge, y up, z out of its face.
"""

from __future__ import annotations

import numpy as np

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose

DICTIONARY = "DICT_4X4_50"
"""OpenCV's name of the patterns."""
COUNT = 50
"""Identities are below this."""
CELLS = 6
"""Of a marker along a side: four of the code and a black border."""
BORDER = 1
"""White cells around a marker that belong to its plate."""


def marker_on(obstacle: Obstacle) -> Pose:
    """Where an upright obstacle's marker lies: flat, in the middle of its upper face."""
    up = np.array([0.0, 0.0, rise(obstacle)])
    return Pose(np.array(obstacle.position) + up, np.array(obstacle.orientation))


def rise(obstacle: Obstacle) -> float:
    """How far an upright obstacle's upper face lies above its centre [m]."""
    match obstacle.shape:
        case "cylinder":
            return obstacle.height / 2.0
        case "capsule":
            return obstacle.height / 2.0 + obstacle.radius
        case "sphere":
            return obstacle.radius
        case "box":
            return obstacle.size[2] / 2.0
        case "half_space":
            return 0.0
