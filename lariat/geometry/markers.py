"""Square markers (ArUco 4x4_50) and their places on obstacles.

Frame of a marker: x to the right along its upper edge, y up, z out of its face.
"""

from __future__ import annotations

import numpy as np

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose

MARKER_DICTIONARY = "DICT_4X4_50"
"""Name of the dictionary of patterns in OpenCV."""
MARKER_COUNT = 50
"""Number of identities in the dictionary."""
MARKER_CELLS = 6
"""Cells along a side of a marker: four of the code and a black border."""
PLATE_MARGIN_CELLS = 1
"""Width of the white margin of a marker's plate [cells]."""


def marker_pose(obstacle: Obstacle) -> Pose:
    """Return the pose of the marker on an upright obstacle: flat, centred on its upper face."""
    up = np.array([0.0, 0.0, top_height(obstacle)])
    return Pose(np.array(obstacle.position) + up, np.array(obstacle.orientation))


def top_height(obstacle: Obstacle) -> float:
    """Return the height of an upright obstacle's upper face above its centre [m]."""
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
