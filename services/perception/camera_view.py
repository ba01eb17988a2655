"""Undistorted frames of one calibrated camera."""

from __future__ import annotations

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from jaxtyping import UInt8, UInt16

from lariat.files.image_header import check_image
from lariat.geometry.cameras import Intrinsics, Picture
from lariat.perception.rgbd.lens_distortion import Undistortion
from services.perception.decoding import decode_color, decode_frame
from shared.camera_messages import intrinsics_of

Images = tuple[Picture, UInt16[np.ndarray, "h w"]]
"""Red, green, blue or the brightness, and depth [mm], 0 where nothing was measured."""


class CameraView:
    """Decodes and undistorts the frames of one camera with its newest calibration."""

    def __init__(self, name: str, grey: bool = False) -> None:
        self._name, self._grey = name, grey
        self._calibration: tuple[Intrinsics, tuple[float, ...], str] | None = None
        self._undistortion: Undistortion | None = None
        self.calibration_count = 0
        """Number of calibrations so far; grows whenever the calibration changes."""

    @property
    def intrinsics(self) -> Intrinsics | None:
        """Intrinsics of the newest calibration; None before the first."""
        return self._calibration[0] if self._calibration is not None else None

    def images(
        self, color: CompressedImage, depth: RawImage, calibration: CameraCalibration | None
    ) -> Images | str:
        """Return undistorted images, or the reason why there are none."""
        if calibration is None:
            return f"no calibration of camera {self._name!r}"
        # Before anything is decoded: an image may claim any number of pixels.
        try:
            sizes = check_image(color.data), (depth.width, depth.height)
        except ValueError as error:
            return f"colour image of camera {self._name!r}: {error}"
        size = calibration.width, calibration.height
        if sizes != (size, size):
            shown = " and ".join(f"{width} x {height}" for width, height in sizes)
            return f"images are {shown}, but the calibration is for {size[0]} x {size[1]}"
        images = decode_frame(color, depth, self._grey)
        if isinstance(images, str):
            return images
        try:
            undistortion = self._calibrated(calibration)
        except (IndexError, ValueError, cv2.error) as error:
            return f"calibration of camera {self._name!r}: {error}"
        return undistortion(*images)

    def color(self, message: CompressedImage) -> UInt8[np.ndarray, "h w 3"]:
        """Return the undistorted RGB of an image that `images` has accepted."""
        picture = decode_color(message)
        assert picture is not None
        assert self._undistortion is not None
        return self._undistortion.color(picture)

    def _calibrated(self, message: CameraCalibration) -> Undistortion:
        calibration = intrinsics_of(message), tuple(message.D), message.distortion_model
        if self._undistortion is None or self._calibration != calibration:
            self._undistortion = Undistortion(*calibration)
            self._calibration = calibration
            self.calibration_count += 1
        return self._undistortion
