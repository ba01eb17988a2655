"""Point clouds: curves, surfaces of obstacles, and depth images in space.

Rerun draws point clouds, but no `foxglove.SceneUpdate`.
"""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from services.recorder.view.colors import RgbaArray
from services.recorder.view.primitives import pose_message
from shared.messages import timestamp

_POINT = np.dtype([("position", "<f4", 3), ("color", "u1", 4)])
"""One point in the message's data."""
_FLOAT, _BYTE = PackedElementField.FLOAT32, PackedElementField.UINT8
_FIELDS = [
    PackedElementField(name=name, offset=offset, type=kind)
    for name, offset, kind in (
        ("x", 0, _FLOAT),
        ("y", 4, _FLOAT),
        ("z", 8, _FLOAT),
        ("red", 12, _BYTE),
        ("green", 13, _BYTE),
        ("blue", 14, _BYTE),
        ("alpha", 15, _BYTE),
    )
]
MAX_DEPTH_POINTS = 5000
"""Most points that are drawn of a depth image."""
DEPTH_SHADE = (0.75, 0.75, 0.75, 1.0)
"""Colour of a depth image's points: red, green, blue, alpha [-]."""
_DEPTH_TYPES = {"16UC1": ("<u2", 1e-3), "mono16": ("<u2", 1e-3), "32FC1": ("<f4", 1.0)}
"""Type of a pixel and its unit [m], by the image's encoding."""


def point_cloud(
    points: Float64[np.ndarray, "n 3"], colors: RgbaArray, frame: str, stamp: int
) -> PointCloud:
    """Return points in a frame [m] as a message, stamped [ns]."""
    packed = np.empty(len(points), _POINT)
    packed["position"] = points
    packed["color"] = np.round(255.0 * colors)
    return PointCloud(
        timestamp=timestamp(stamp),
        frame_id=frame,
        pose=pose_message(Pose(np.zeros(3), poses.IDENTITY)),
        point_stride=_POINT.itemsize,
        fields=_FIELDS,
        data=packed.tobytes(),
    )


def depth_points(image: RawImage, calibration: CameraCalibration) -> Float64[np.ndarray, "n 3"]:
    """Return points of a depth image in the camera's frame [m], z along the optical axis.

    Pixels without a measurement are left out, and so many others that at most `MAX_DEPTH_POINTS`
    remain. An image that is not a depth image has no points.
    """
    if image.encoding not in _DEPTH_TYPES or len(calibration.K) != 9:
        return np.zeros((0, 3))
    kind, unit = _DEPTH_TYPES[image.encoding]
    pixels = np.frombuffer(image.data, kind)
    if len(pixels) != image.width * image.height:
        return np.zeros((0, 3))
    every = int(np.ceil(np.sqrt(max(len(pixels), 1) / MAX_DEPTH_POINTS)))
    depth = unit * pixels.reshape(image.height, image.width)[::every, ::every].astype(float)
    fx, _, cx, _, fy, cy, *_ = calibration.K
    column, row = np.arange(0, image.width, every), np.arange(0, image.height, every)
    x, y = np.meshgrid((column - cx) / fx, (row - cy) / fy)
    points = np.stack([x * depth, y * depth, depth], axis=-1).reshape(-1, 3)
    return points[np.isfinite(points[:, 2]) & (points[:, 2] > 0.0)]
