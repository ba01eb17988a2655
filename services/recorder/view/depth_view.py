"""Drawing of one camera's depth images as points."""

from __future__ import annotations

from collections.abc import Iterator

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from lariat.trajectory import SECOND
from services.recorder.view import colors
from services.recorder.view.point_clouds import DEPTH_SHADE, depth_points, point_cloud
from shared import topics
from shared.runtime.service import Publication

DEPTH_PERIOD = SECOND // 2
"""Least time between two depth images that are drawn [ns]."""


class DepthView:
    """Newest depth image and calibration of a camera."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._depth_key = topics.CAMERA_DEPTH.at(name).key
        self._calibration_key = topics.CAMERA_CALIBRATION.at(name).key
        self.cloud = topics.VIEW_POINTS.at(name)
        """Topic of its points."""
        self._depth = self._calibration = b""
        self._drawn, self._is_new = -DEPTH_PERIOD, False

    def take(self, key: str, payload: bytes) -> None:
        """Take an encoded message of any topic."""
        if key == self._depth_key:
            self._depth, self._is_new = payload, True
        elif key == self._calibration_key:
            self._calibration = payload

    def draw(self, now: int, again: bool) -> Iterator[Publication]:
        """Draw the newest image if it is due, or again, for viewers that come late."""
        due = now - self._drawn >= DEPTH_PERIOD and (self._is_new or again)
        if not (due and self._depth and self._calibration):
            return
        self._drawn, self._is_new = now, False
        image = RawImage.FromString(self._depth)
        points = depth_points(image, CameraCalibration.FromString(self._calibration))
        shades = colors.uniform(DEPTH_SHADE, len(points))
        yield Publication(self.cloud, point_cloud(points, shades, self._name, now))
