"""Messages of a camera, real or simulated, stamped by `stamped`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from jaxtyping import UInt8, UInt16

from lariat.geometry.cameras import Intrinsics
from shared.messages import timestamp

JPEG_QUALITY = 95
"""Quality of the colour images [%]."""
CameraMessage = TypeVar("CameraMessage", CompressedImage, RawImage, CameraCalibration)


def stamped(message: CameraMessage, camera: str, stamp: int) -> CameraMessage:
    """Return a message as that of a camera at `stamp` [ns]."""
    message.timestamp.CopyFrom(timestamp(stamp))
    message.frame_id = camera
    return message


def color_message(color: UInt8[np.ndarray, "h w 3"]) -> CompressedImage:
    """JPEG of an RGB image."""
    bgr = cv2.cvtColor(color, cv2.COLOR_RGB2BGR)
    jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
    return CompressedImage(data=jpeg.tobytes(), format="jpeg")


def depth_message(depth: UInt16[np.ndarray, "h w"]) -> RawImage:
    """Depth image [mm].

    It is not compressed: a PNG of noise costs more than the rendering, on both sides of the bus.
    """
    height, width = depth.shape
    data = depth.astype("<u2", copy=False).tobytes()
    return RawImage(width=width, height=height, encoding="16UC1", step=2 * width, data=data)


def calibration_message(
    size: tuple[int, int],
    fx: float,
    fy: float,
    cx: float,
    cy: float,
    distortion: Sequence[float] = (0.0,) * 5,
    model: str = "plumb_bob",
) -> CameraCalibration:
    """Calibration of a camera of columns and rows: focal lengths and principal point [pixels]."""
    return CameraCalibration(
        width=size[0],
        height=size[1],
        distortion_model=model,
        D=distortion,
        K=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        R=np.eye(3).ravel(),
        P=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def intrinsics_of(calibration: CameraCalibration) -> Intrinsics:
    """Pinhole of a calibration message, without its distortion."""
    k = calibration.K
    return Intrinsics(calibration.width, calibration.height, k[0], k[4], k[2], k[5])
