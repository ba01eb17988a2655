"""Intrinsics and true pose of a simulated camera."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.poses import Pose
from lariat.scenario.cameras import CameraSetup
from lariat.scenario.sections import Plant


def true_camera(setup: CameraSetup, plant: Plant) -> Camera:
    """Camera at its true pose: the known one, displaced by `plant.camera_*`."""
    nominal = setup.T_world_camera
    turn = poses.exponential(np.radians(plant.camera_turn))
    position = nominal.position + np.array(plant.camera_shift)
    return Camera(setup.intrinsics, Pose(position, poses.multiply(turn, nominal.orientation)))
