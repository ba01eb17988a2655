"""Correction of the depth bias."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.rgbd.depth_bias import DepthBias
from lariat.perception.tracking.centerline_tracker import CenterlineTracker
from lariat.rod import RodProperties
from lariat.simulation.camera.sensor_noise import SensorNoise
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips, taken

BELIEVED = RodProperties(ROPE.length, 2.0 * ROPE.radius, 0.044, 1e6)


def moved(camera: Camera, shift: tuple[float, float, float]) -> Camera:
    pose = camera.T_world_camera
    return replace(camera, T_world_camera=Pose(pose.position + np.array(shift), pose.orientation))


@pytest.mark.parametrize(
    ("bias", "camera"), [(0.005, CAMERA), (-0.008, CAMERA), (0.0, moved(CAMERA, (0.0, 0.0, 0.006)))]
)
def test_a_depth_bias_is_corrected_on_the_table(bias: float, camera: Camera) -> None:
    nodes = curve(4)
    frame = taken(nodes, camera=camera, noise=SensorNoise(depth_bias=bias))
    errors = []
    for planes in ((), (TABLE,)):
        tracker = CenterlineTracker(CenterlineEstimator(CAMERA, ROPE), BELIEVED, planes)
        found = tracker.track(frame.color, frame.depth, *grips(nodes), 0)
        errors.append(float(np.mean(np.linalg.norm(found.positions - nodes, axis=1))))
    assert errors[0] > 3e-3
    assert errors[1] < 1.5e-3


def test_exact_depth_is_not_corrected() -> None:
    bias = DepthBias(CAMERA, (TABLE,))
    for frame in range(5):
        assert bias.update(taken(curve(4), frame=frame).depth) == 0.0


@pytest.mark.parametrize(("block", "expected"), [(1, 0.0), (6, 0.003)])
def test_only_noise_that_neighbouring_pixels_share_counts(block: int, expected: float) -> None:
    bias, exact = DepthBias(CAMERA, (TABLE,)), taken(curve(4)).depth.astype(float)
    random = np.random.default_rng(0)
    for _ in range(30):
        coarse = random.normal(0.0, 3.0, [-(-n // block) for n in exact.shape])
        noise = np.kron(coarse, np.ones((block, block)))[: exact.shape[0], : exact.shape[1]]
        bias.update(np.rint(exact + noise).astype(np.uint16))
    assert bias.shared_noise == pytest.approx(expected, abs=5e-4)


def test_obstacles_on_the_table_are_excluded_from_the_bias() -> None:
    thin, thick = (
        Obstacle("box", (0.0, 0.0, height / 2.0), size=(2.0, 2.0, height))
        for height in (0.008, 0.02)
    )
    depth = taken(curve(4), (thin,)).depth
    assert DepthBias(CAMERA, (TABLE,)).update(depth) == pytest.approx(-0.008, abs=5e-4)
    # The obstacle is known, or thicker than any accepted bias.
    assert DepthBias(CAMERA, (TABLE, thin)).update(depth) == 0.0
    assert DepthBias(CAMERA, (TABLE,)).update(taken(curve(4), (thick,)).depth) == 0.0


def test_a_tilted_camera_and_missing_depth_are_not_corrected() -> None:
    tilted = Pose(
        CAMERA.T_world_camera.position,
        poses.multiply(
            poses.exponential(np.radians([0.0, 2.0, 0.0])), CAMERA.T_world_camera.orientation
        ),
    )
    depth = taken(curve(4), camera=replace(CAMERA, T_world_camera=tilted)).depth
    assert DepthBias(CAMERA, (TABLE,)).update(depth) == 0.0
    # No plane is known, or no depth is measured.
    assert DepthBias(CAMERA, ()).update(depth) == 0.0
    assert DepthBias(CAMERA, (TABLE,)).update(np.zeros_like(depth)) == 0.0
