"""Messages of the simulated camera."""

from __future__ import annotations

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


def color_message(color: UInt8[np.ndarray, "h w 3"], camera: str, stamp: int) -> CompressedImage:
    """JPEG of an RGB image, taken by a camera at `stamp` [ns]."""
    bgr = cv2.cvtColor(color, cv2.COLOR_RGB2BGR)
    jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
    return CompressedImage(
        timestamp=timestamp(stamp), frame_id=camera, data=jpeg.tobytes(), format="jpeg"
    )


def depth_message(depth: UInt16[np.ndarray, "h w"], camera: str, stamp: int) -> RawImage:
    """Depth image [mm], taken by a camera at `stamp` [ns].

    It is not compressed: a PNG of noise costs more than the rendering, on both sides of the bus.
    """
    height, width = depth.shape
    return RawImage(
        timestamp=timestamp(stamp),
        frame_id=camera,
        width=width,
        height=height,
        encoding="16UC1",
        step=2 * width,
        data=depth.astype("<u2", copy=False).tobytes(),
    )


def calibration_message(intrinsics: Intrinsics, camera: str, stamp: int) -> CameraCalibration:
    """Calibration of a camera without distortion, published at `stamp` [ns]."""
    i = intrinsics
    return CameraCalibration(
        timestamp=timestamp(stamp),
        frame_id=camera,
        width=i.width,
        height=i.height,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=[i.fx, 0.0, i.cx, 0.0, i.fy, i.cy, 0.0, 0.0, 1.0],
        R=np.eye(3).ravel(),
        P=[i.fx, 0.0, i.cx, 0.0, 0.0, i.fy, i.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )
