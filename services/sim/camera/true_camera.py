"""Intrinsics and true pose of the simulated camera."""

from __future__ import annotations

import math

import numpy as np

from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.poses import Pose
from shared.scenario import Scenario


def true_camera(scenario: Scenario) -> Camera:
    """Camera of a scenario at its true pose: the known one, displaced by `plant.camera_*`."""
    sensing, known = scenario.sensing, scenario.camera_pose
    intrinsics = Intrinsics.symmetric(*sensing.resolution, math.radians(sensing.field_of_view))
    turn = poses.exponential(np.radians(scenario.plant.camera_turn))
    position = known.position + np.array(scenario.plant.camera_shift)
    return Camera(intrinsics, Pose(position, poses.multiply(turn, known.orientation)))
