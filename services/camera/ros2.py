"""RGB-D camera of a ROS 2 graph, with depth registered to colour."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from lariat.configuration import ConfigurationError
from services.camera.source import Exposure
from shared.bus import BusError
from shared.camera_messages import color_message, depth_message
from shared.door import Door
from shared.ros2.node import Node
from shared.ros2.types import nanoseconds
from shared.ros2.wire import SENSOR

MAX_GAP = 20_000_000
"""Largest difference between the stamps of colour and depth of one exposure [ns]."""
CHANNELS = {
    "rgb8": None,
    "bgr8": cv2.COLOR_BGR2RGB,
    "rgba8": cv2.COLOR_RGBA2RGB,
    "bgra8": cv2.COLOR_BGRA2RGB,
}
"""Conversion to red, green, blue of each encoding of colour that is taken."""
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"


class Ros2Camera:
    """Source whose colour, depth and intrinsics are topics of ROS 2."""

    def __init__(self, color: str, depth: str, info: str, router: str, domain: int) -> None:
        """Join the graph; `color` is compressed if it ends in `/compressed`."""
        try:
            self._node = Node("lariat_camera", "/lariat", domain, router)
        except BusError as error:
            raise ConfigurationError(str(error)) from None
        self.door: Door = self._node.door
        kind = COMPRESSED if color.endswith("/compressed") else IMAGE
        self._color = self._node.subscription(color, kind, SENSOR)
        self._depth = self._node.subscription(depth, IMAGE, SENSOR)
        self._info = self._node.subscription(info, "sensor_msgs/msg/CameraInfo")
        self._calibration: CameraCalibration | None = None
        self._colors: list[Any] = []
        self._depths: list[Any] = []

    def newest(self, now: int) -> Exposure | None:
        """Return the newest exposure; None if there is none."""
        for message in self._info.take():
            with self.door.guard("ROS 2 camera_info"):
                self._calibration = _calibration(message)
        self._colors = [*self._colors, *self._color.take()][-SENSOR.depth :]
        self._depths = [*self._depths, *self._depth.take()][-SENSOR.depth :]
        pair = self._pair()
        if self._calibration is None or pair is None:
            return None
        color, depth = pair
        self._colors = [c for c in self._colors if _stamp(c) > _stamp(color)]
        self._depths = [d for d in self._depths if _stamp(d) > _stamp(depth)]
        with self.door.guard("ROS 2 image"):
            return Exposure(_jpeg(color), _millimetres(depth), self._calibration, _stamp(color))
        return None

    def close(self) -> None:
        """Leave the graph."""
        self._node.close()

    def _pair(self) -> tuple[Any, Any] | None:
        """Newest colour and depth of one exposure."""
        for color in sorted(self._colors, key=_stamp, reverse=True):
            near = [d for d in self._depths if abs(_stamp(d) - _stamp(color)) <= MAX_GAP]
            if near:
                return color, min(near, key=lambda d: abs(_stamp(d) - _stamp(color)))
        return None


def _stamp(message: Any) -> int:
    return nanoseconds(message.header.stamp)


def _pixels(message: Any, dtype: str, channels: int) -> np.ndarray:
    """Pixels of an image."""
    order = ">" if message.is_bigendian else "<"
    row = np.dtype(order + dtype).itemsize * channels * message.width
    data = np.asarray(message.data, np.uint8)
    if not 0 < row <= message.step or len(data) < message.step * message.height:
        raise ValueError(f"{len(data)} bytes are no image of {message.width} x {message.height}")
    rows = data[: message.step * message.height].reshape(message.height, message.step)[:, :row]
    return np.ascontiguousarray(rows).view(order + dtype).reshape(message.height, message.width, -1)


def _jpeg(message: Any) -> CompressedImage:
    if message.__msgtype__ == COMPRESSED:
        return CompressedImage(format="jpeg", data=np.asarray(message.data).tobytes())
    if message.encoding not in CHANNELS:
        raise ValueError(f"colour is {message.encoding!r}; use one of {', '.join(CHANNELS)}")
    image = _pixels(message, "u1", 4 if "a" in message.encoding else 3)
    conversion = CHANNELS[message.encoding]
    return color_message(image if conversion is None else cv2.cvtColor(image, conversion))


def _millimetres(message: Any) -> RawImage:
    if message.encoding in ("16UC1", "mono16"):
        depth = _pixels(message, "u2", 1)
    elif message.encoding == "32FC1":
        metres = np.nan_to_num(_pixels(message, "f4", 1), posinf=0.0, neginf=0.0)
        depth = np.clip(np.rint(1e3 * metres), 0, 65535)
    else:
        raise ValueError(f"depth is {message.encoding!r}; use 16UC1 [mm] or 32FC1 [m]")
    return depth_message(depth[..., 0].astype(np.uint16))


def _calibration(message: Any) -> CameraCalibration:
    return CameraCalibration(
        width=message.width,
        height=message.height,
        distortion_model=message.distortion_model,
        D=np.asarray(message.d).tolist(),
        K=np.asarray(message.k).tolist(),
        R=np.asarray(message.r).tolist(),
        P=np.asarray(message.p).tolist(),
    )
