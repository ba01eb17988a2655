"""Camera of the simulated lab: images and calibration on the topics of its name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle
from lariat.scenario import Scenario
from lariat.scenario.cameras import CameraSetup
from lariat.simulation.camera.marker_plates import MarkerPlate
from lariat.simulation.camera.rgbd_camera import RGB, RgbdCamera, Tube
from lariat.simulation.camera.sensor_noise import SensorNoise
from lariat.simulation.camera.true_camera import true_camera
from lariat.trajectory import SECOND
from shared import topics
from shared.camera_messages import calibration_message, color_message, depth_message, stamped
from shared.runtime.service import Publication

BACKGROUND = 40
"""Grey value of the room behind the scene [1/255]."""
CALIBRATION_PERIOD = SECOND
"""Time between two calibration messages [ns]."""
SEED_STRIDE = 1_000_003
"""Difference between the seeds of two cameras of a cell, a prime [-]."""


class LabCamera:
    """One of the cameras of a scenario, with the topics of its name."""

    def __init__(self, scenario: Scenario, setup: CameraSetup, number: int) -> None:
        sensing = scenario.sensing
        self._name, self._radius = setup.name, scenario.plant_rope.diameter / 2.0
        self._camera = RgbdCamera(
            true_camera(setup, scenario.plant),
            SensorNoise(
                depth_sigma=sensing.depth_noise,
                depth_bias=sensing.depth_bias,
                depth_quantum=sensing.depth_quantum,
                edge_dropout=sensing.edge_dropout,
                edge_mixing=sensing.edge_dropout,
            ),
            seed=scenario.seed + number * SEED_STRIDE,
            rope_color=scenario.plant.color,
            background=BACKGROUND,
        )
        self._color = topics.CAMERA_COLOR.at(setup.name)
        self._depth = topics.CAMERA_DEPTH.at(setup.name)
        self._calibration = topics.CAMERA_CALIBRATION.at(setup.name)
        self.writes = (self._color, self._depth, self._calibration)
        self._calibration_time = -CALIBRATION_PERIOD

    def publish_calibration(self, instant: int) -> Iterator[Publication]:
        """Publish the calibration if it is due at an instant [ns]."""
        if instant - self._calibration_time >= CALIBRATION_PERIOD:
            self._calibration_time = instant
            i = self._camera.camera.intrinsics
            message = calibration_message((i.width, i.height), i.fx, i.fy, i.cx, i.cy)
            yield Publication(self._calibration, stamped(message, self._name, instant))

    def publish_images(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        bodies: Sequence[Obstacle],
        colors: Sequence[RGB],
        plates: Sequence[MarkerPlate],
        tubes: Sequence[Tube],
        number: int,
        instant: int,
    ) -> Iterator[Publication]:
        """Take an image and publish it; `number` selects its noise, `instant` is its time [ns]."""
        frame = self._camera.take(nodes, self._radius, bodies, colors, number, plates, tubes)
        color, depth = color_message(frame.color), depth_message(frame.depth)
        yield Publication(self._color, stamped(color, self._name, instant))
        yield Publication(self._depth, stamped(depth, self._name, instant))
