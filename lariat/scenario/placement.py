"""Placement of the arm of an end: its base in the world and the grip at its flange."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.scenario.sections import End


def base_of(end: End) -> Pose:
    """Return the pose of an arm's base in the world."""
    return Pose(np.array(end.base_position), poses.normalized(np.array(end.base_orientation)))


def tool_of(end: End) -> Pose:
    """Return the pose of the grip at the flange."""
    return Pose(np.array(end.tool_position), poses.normalized(np.array(end.tool_orientation)))
