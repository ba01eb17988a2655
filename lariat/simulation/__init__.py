"""Simulated lab: ropes as plants, and an RGB-D camera that sees them.

`World` is the rope of a scenario between its grips, among its obstacles; `RgbdCamera` takes its
pictures. Plants of MuJoCo need the extra `simulation`, `plant.model = "rod"` does not.
"""

from __future__ import annotations

from lariat.simulation.camera.rgbd_camera import Frame, RgbdCamera
from lariat.simulation.camera.sensor_noise import SensorNoise
from lariat.simulation.camera.true_camera import true_camera
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.factory import build_plant
from lariat.simulation.plants.plant import Plant
from lariat.simulation.world import World

__all__ = [
    "EndMotion",
    "Frame",
    "Plant",
    "RgbdCamera",
    "SensorNoise",
    "World",
    "build_plant",
    "true_camera",
]
