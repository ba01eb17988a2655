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
    up = np.array([0.0, 0.0, upper_face(obstacle)])
    return Pose(np.array(obstacle.position) + up, np.array(obstacle.orientation))


def upper_face(obstacle: Obstacle) -> float:
    """Return the height of an upright obstacle's upper face above its centre [m]."""
    if obstacle.shape == "half_space":
        return 0.0
    return float(obstacle.row.support(obstacle.packed_sizes, np.array([0.0, 0.0, 1.0])))
