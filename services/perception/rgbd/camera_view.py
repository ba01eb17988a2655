"""One camera as perception has it: its calibration, its lens, and who follows the rope in it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from jaxtyping import UInt8, UInt16

from lariat.geometry.cameras import Intrinsics
from services.perception.rgbd.decoding import decoded
from services.perception.rgbd.lens_distortion import Undistortion
from services.perception.tracking.centerline_tracker import Tracker

Images = tuple[UInt8[np.ndarray, "h w 3"], UInt16[np.ndarray, "h w"]]


class CameraView:
    """Reads frames of the camera called `name`; begins anew when its calibration changes."""

    def __init__(self, name: str, tracker_of: Callable[[Intrinsics], Tracker]) -> None:
        """
        Args:
            name: Of the camera, for words.
            tracker_of: Makes who follows the rope in images of such a pinhole.
        """
        self._name = name
        self._tracker_of = tracker_of
        self._known: tuple[Intrinsics, tuple[float, ...], str] | None = None
        self._lens: Undistortion | None = None
        self.tracker: Tracker | None = None
        """None before the first calibration."""
        self.repeats = 0
        """So many frames in a row were the same as the one before."""
        self._last = (b"", b"")

    def repeated(self, color: CompressedImage, depth: RawImage) -> bool:
        """Whether a frame is the one before once more."""
        now = (color.data, depth.data)
        self.repeats = self.repeats + 1 if now == self._last else 0
        self._last = now
        return self.repeats > 0

    def images(
        self, color: CompressedImage, depth: RawImage, calibration: CameraCalibration | None
    ) -> Images | str:
        """RGB and depth [mm] as a pinhole sees them, or why there are none."""
        if calibration is None:
            return f"no calibration of camera {self._name!r}"
        images = decoded(color, depth)
        if isinstance(images, str):
            return images
        try:
            lens = self._calibrated(calibration)
        except (IndexError, ValueError) as error:
            return f"calibration of camera {self._name!r}: {error}"
        wanted = calibration.height, calibration.width
        if images[0].shape[:2] != wanted or images[1].shape != wanted:
            sizes = " and ".join(f"{i.shape[1]} x {i.shape[0]}" for i in images)
            return f"images are {sizes}, the calibration says {wanted[1]} x {wanted[0]}"
        return lens(*images)

    def _calibrated(self, message: CameraCalibration) -> Undistortion:
        k = message.K
        intrinsics = Intrinsics(message.width, message.height, k[0], k[4], k[2], k[5])
        known = intrinsics, tuple(message.D), message.distortion_model
        if self._lens is None or self._known != known:
            self._lens = Undistortion(message)
            self._known = known
            self.tracker = self._tracker_of(intrinsics)
        return self._lens
