"""Tolerances by value, by fraction, by pixels and in the median."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from shared import topics
from shared.messages import Estimate, NodeChain, Parameters, RodParameters, Trace
from stack.replay.comparison import field_differences, largest_differences

DEPTH = replace(topics.CAMERA_DEPTH.at("overhead"), pixel_tolerance=0.01)
COLOR = replace(topics.CAMERA_COLOR.at("overhead"), pixel_tolerance=0.01)


def depth(changed: int) -> RawImage:
    values = np.full(200, 1000, "<u2")
    values[:changed] += 1
    return RawImage(width=20, height=10, step=40, encoding="16UC1", data=values.tobytes())


def test_a_relative_tolerance_scales_with_the_value():
    def parameters(value: float) -> Parameters:
        return Parameters(rod=RodParameters(length=Estimate(value=value)))

    topic = topics.CONTROLLER_PARAMETERS
    a = parameters(2e-4)
    assert not list(field_differences(topic, a, parameters(2e-4 * (1 + 5e-7))))
    (found,) = field_differences(topic, a, parameters(2e-4 * (1 + 5e-6)))
    assert found.path == "rod.length.value"
    assert found.size == pytest.approx(1e-9)


def test_a_few_depth_pixels_may_fall_to_the_other_side_of_a_rounding_step():
    assert not list(field_differences(DEPTH, depth(0), depth(2)))
    (found,) = field_differences(DEPTH, depth(0), depth(3))
    assert (found.path, found.size) == ("data", pytest.approx(0.015))


def test_images_of_another_size_differ():
    larger = depth(0)
    larger.height, larger.data = 11, larger.data + bytes(40)
    assert "data" in [d.path for d in field_differences(DEPTH, depth(0), larger)]


def test_compressed_images_are_compared_by_their_pixels():
    image = np.zeros((40, 40, 3), np.uint8)
    image[10:20] = 200

    def jpeg(pixels: np.ndarray) -> CompressedImage:
        return CompressedImage(format="jpeg", data=cv2.imencode(".jpg", pixels)[1].tobytes())

    single, many = image.copy(), image.copy()
    single[30, 30] += 1
    many[25:] = 90
    assert not list(field_differences(COLOR, jpeg(image), jpeg(single)))
    assert [d.path for d in field_differences(COLOR, jpeg(image), jpeg(many))] == ["data"]


def test_times_in_nanoseconds_are_compared_exactly():
    now = 1_780_000_000_000_000_000
    (found,) = field_differences(topics.TRACE.at("sim"), Trace(now=now), Trace(now=now + 1))
    assert (found.path, found.size) == ("now", 1)


def test_the_largest_difference_is_measured_where_a_median_is_limited():
    a, b = NodeChain(positions=[0.0, 1.0, 2.0]), NodeChain(positions=[0.0, 1.0 + 3e-8, 2.0])
    sizes = largest_differences(topics.ROPE_NODES, a, b)
    assert sizes == {"positions": pytest.approx(3e-8, rel=1e-6)}
    assert not list(field_differences(topics.ROPE_NODES, a, b))
