"""The tracker learns the length of the rope from the frames that show it whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.geometry.obstacles import TABLE
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.tracking.centerline_tracker import (
    MIN_LENGTH_COUNT,
    CenterlineTracker,
    LengthMean,
)
from lariat.rod import RodProperties
from lariat.simulation.camera.rgbd_camera import RgbdCamera
from lariat.simulation.camera.sensor_noise import SensorNoise
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips


@pytest.mark.parametrize("ratio", [0.98, 1.02])
def test_a_rope_whose_length_is_given_wrongly_is_followed_where_it_is(ratio: float) -> None:
    nodes = curve(2, bend=0.8)
    believed = replace(ROPE, length=ratio * ROPE.length)
    estimator = CenterlineEstimator(CAMERA, believed)
    properties = RodProperties(believed.length, 0.008, 0.044, 1e6)
    tracker = CenterlineTracker(estimator, properties, [TABLE])
    camera = RgbdCamera(CAMERA, SensorNoise(), seed=1)
    dense = polylines.resample_smooth(nodes, 3000)
    off = []
    for k in range(8):
        frame = camera.take(nodes, ROPE.radius, [TABLE], frame=k)
        stamp = 1_000_000_000 + k * 33_000_000
        found = tracker.track(frame.color, frame.depth, *grips(nodes), stamp)
        apart = polylines.point_distances(found.positions, dense).min(axis=1)
        off.append(float(np.mean(apart[found.observed])))
    assert np.mean(off[MIN_LENGTH_COUNT:]) < 0.7 * off[0]
    # After a reset another rope may be there: its first frame is fitted with the given length.
    tracker.forget()
    frame = camera.take(nodes, ROPE.radius, [TABLE], frame=0)
    again = tracker.track(frame.color, frame.depth, *grips(nodes), 2_000_000_000)
    apart = polylines.point_distances(again.positions, dense).min(axis=1)
    assert np.mean(apart[again.observed]) == pytest.approx(off[0], rel=0.05)


def test_the_length_is_measured_often_at_first_and_bounded() -> None:
    length = LengthMean()
    for _ in range(5):
        assert length.now().measure
        length.take(1.2)
    assert length.now().ratio == pytest.approx(1.03)
    assert sum(length.now().measure for _ in range(30)) == 3
    length.take(None)
    assert length.now().ratio == pytest.approx(1.03)


def test_nodes_of_a_rope_in_motion_are_less_certain() -> None:
    nodes = curve(2, bend=0.8)
    camera = RgbdCamera(CAMERA, SensorNoise(), seed=1)
    sigmas = []
    for step in (0.0, 0.02):
        tracker = CenterlineTracker(
            CenterlineEstimator(CAMERA, ROPE), RodProperties(ROPE.length, 0.008, 0.044, 1e6)
        )
        median = 0.0
        for k in range(3):
            moved = nodes + k * np.array([0.0, step, 0.0])
            frame = camera.take(moved, ROPE.radius, [TABLE], frame=k)
            stamp = 1_000_000_000 + k * 40_000_000
            found = tracker.track(frame.color, frame.depth, *grips(moved), stamp)
            median = float(np.median(found.sigma))
        sigmas.append(median)
    assert sigmas[1] > sigmas[0] + 2e-4


def test_the_given_length_stands_until_several_measurements_find_it_wrong() -> None:
    length = LengthMean()
    for measured in (0.995, 0.997, 0.997, 0.997):
        length.take(measured)
        assert length.now().ratio == 1.0
    length.take(0.989)
    assert length.now().ratio == pytest.approx(0.995)
    length.take(1.001)
    assert length.now().ratio == pytest.approx(0.996)
