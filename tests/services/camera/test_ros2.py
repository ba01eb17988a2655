"""ROS 2 camera: exposures whose depth is in millimetres, whatever the encodings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
import pytest

from services.camera.ros2 import Ros2Camera
from shared.ros2.node import Node
from shared.ros2.outputs import outputs
from shared.ros2.types import header, ros
from shared.ros2.wire import SENSOR
from shared.runtime.free_port import free_port
from tests.shared.cell import until

WIDTH, HEIGHT = 8, 6
IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"


class Bench:
    """Camera of a graph, and the source that hears it."""

    def __init__(self) -> None:
        router = f"tcp/127.0.0.1:{free_port()}"
        self.node = Node("camera", router=router)
        self.color = self.node.publisher("/c/color", IMAGE, SENSOR)
        self.depth = self.node.publisher("/c/depth", IMAGE, SENSOR)
        self.info = self.node.publisher("/c/info", INFO)
        self.source = Ros2Camera("/c/color", "/c/depth", "/c/info", router, 0)
        until(lambda: self.color.matched and self.depth.matched and self.info.matched)
        self.info.put(info())

    def send(self, stamp: int, color: Any, depth: Any, gap: int = 0) -> None:
        self.color.put(image(stamp, *color))
        self.depth.put(image(stamp + gap, *depth))

    def close(self) -> None:
        self.source.close()
        self.node.close()


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def image(stamp: int, encoding: str, pixels: np.ndarray) -> Any:
    flat = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(pixels), -1)
    return ros(
        IMAGE,
        header=header(stamp, "c"),
        height=flat.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=int(pixels.dtype.byteorder == ">"),
        step=flat.shape[1],
        data=flat.ravel(),
    )


def info() -> Any:
    region = ros(
        "sensor_msgs/msg/RegionOfInterest",
        x_offset=0,
        y_offset=0,
        height=0,
        width=0,
        do_rectify=False,
    )
    return ros(
        INFO,
        header=header(0, "c"),
        height=HEIGHT,
        width=WIDTH,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.array([10.0, 0, 4, 0, 10, 3, 0, 0, 1]),
        r=np.eye(3).ravel(),
        p=np.zeros(12),
        binning_x=0,
        binning_y=0,
        roi=region,
    )


BLUE = ("bgr8", np.full((HEIGHT, WIDTH, 3), (255, 0, 0), np.uint8))


@pytest.mark.parametrize(
    "depth",
    [
        ("16UC1", np.full((HEIGHT, WIDTH), 700, "<u2")),
        ("16UC1", np.full((HEIGHT, WIDTH), 700, ">u2")),
        ("32FC1", np.full((HEIGHT, WIDTH), 0.7, "<f4")),
    ],
    ids=["millimetres", "big-endian", "metres"],
)
def test_depth_is_in_millimetres(bench: Bench, depth: tuple[str, np.ndarray]):
    bench.send(5, BLUE, depth)
    got: list[Any] = []
    until(lambda: got.append(bench.source.newest(0)) or got[-1])
    exposure = got[-1]
    values = np.frombuffer(exposure.depth.data, "<u2")
    assert (len(values), set(values.tolist()), exposure.time) == (WIDTH * HEIGHT, {700}, 5)
    assert exposure.calibration.K[0] == 10.0


@pytest.mark.parametrize(
    ("encoding", "pixel"),
    [("rgb8", (0, 0, 255)), ("bgr8", (255, 0, 0)), ("rgba8", (0, 0, 255, 255))],
)
def test_colours_arrive_whatever_their_order(bench: Bench, encoding: str, pixel: tuple):
    pixels = np.tile(np.array(pixel, np.uint8), (HEIGHT, WIDTH, 1))
    bench.send(5, (encoding, pixels), ("16UC1", np.full((HEIGHT, WIDTH), 1, "<u2")))
    got: list[Any] = []
    until(lambda: got.append(bench.source.newest(0)) or got[-1])
    seen = cv2.imdecode(np.frombuffer(got[-1].color.data, np.uint8), cv2.IMREAD_COLOR)
    assert seen is not None
    assert seen[3, 4, 0] > 240
    assert seen[3, 4, 2] < 15


def test_images_of_different_times_are_no_exposure(bench: Bench):
    depth = ("16UC1", np.full((HEIGHT, WIDTH), 1, "<u2"))
    bench.send(5, BLUE, depth, gap=10**9)
    bench.send(10**10, BLUE, depth)
    got: list[Any] = []
    until(lambda: got.append(bench.source.newest(0)) or got[-1])
    assert got[-1].time == 10**10


def test_an_image_that_is_none_is_refused_and_the_next_one_taken(bench: Bench):
    depth = ("16UC1", np.full((HEIGHT, WIDTH), 1, "<u2"))
    broken = image(5, *BLUE)
    broken.height = 4000
    bench.color.put(broken)
    bench.depth.put(image(5, *depth))
    until(lambda: bench.source.newest(0) or bench.source.door.refused)
    bench.send(6, BLUE, depth)
    got: list[Any] = []
    until(lambda: got.append(bench.source.newest(0)) or got[-1])
    assert got[-1].time == 6
    assert bench.source.door.refused == 1


def test_it_takes_the_images_that_our_own_node_publishes():
    names = {output.name for output in outputs()}
    assert {
        "camera/{name}/color/image_raw",
        "camera/{name}/depth/image_raw",
        "camera/{name}/color/camera_info",
    } <= names
