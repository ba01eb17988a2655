"""An Intel RealSense through its maker's library, which is an optional extra: camera of the stack.

The library's own recordings (.db3, .bag) play in the device's place.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pyrealsense2 as rs  # pyright: ignore[reportMissingImports]
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from services.camera.source import Shot
from shared.configuration import ConfigurationError

JPEG_QUALITY = 95
MODELS = {
    rs.distortion.none: "plumb_bob",
    rs.distortion.brown_conrady: "plumb_bob",
    # The maker's inverse model is the plumb bob's for the tiny coefficients that devices have.
    rs.distortion.inverse_brown_conrady: "plumb_bob",
}


class RealSense:
    """One device; depth is registered to colour by the library."""

    def __init__(
        self, serial: str, resolution: tuple[int, int], rate: int, recording: Path | None = None
    ) -> None:
        """Starts both streams.

        Args:
            serial: Of the device; empty: the first one.
            resolution: Of both streams [pixels].
            rate: [Hz].
            recording: File that plays instead, as large and as fast as it was recorded.

        Raises:
            ConfigurationError: There is no such device, or it cannot do what is asked.
        """
        self._pipeline = rs.pipeline()
        self._exposed = -1.0
        config = rs.config()
        if recording is not None:
            config.enable_device_from_file(str(recording))
        else:
            if serial:
                config.enable_device(serial)
            config.enable_stream(rs.stream.color, *resolution, rs.format.rgb8, rate)
            config.enable_stream(rs.stream.depth, *resolution, rs.format.z16, rate)
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            width, height = resolution
            asked = f"camera {serial or '(any)'} at {width} x {height}, {rate} Hz"
            raise ConfigurationError(f"{recording or asked}: {error}") from error
        self._millimetres = 1e3 * profile.get_device().first_depth_sensor().get_depth_scale()
        self._align = rs.align(rs.stream.color)

    def newest(self, now: int) -> Shot | None:
        """The newest exposure, when there is one."""
        frames = self._pipeline.poll_for_frames()
        if not frames:
            return None
        frames = self._align.process(frames)
        color, depth = frames.get_color_frame(), frames.get_depth_frame()
        # A new depth may come with the colour of the exposure before.
        if not color or not depth or color.get_timestamp() == self._exposed:
            return None
        self._exposed = color.get_timestamp()
        bgr = np.asanyarray(color.get_data())[..., ::-1]
        jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
        z = np.rint(np.asanyarray(depth.get_data()) * self._millimetres).astype("<u2")
        height, width = z.shape
        return Shot(
            CompressedImage(data=jpeg.tobytes(), format="jpeg"),
            RawImage(
                width=width, height=height, encoding="16UC1", step=2 * width, data=z.tobytes()
            ),
            _calibration(color.profile.as_video_stream_profile().intrinsics),
            round(1e6 * self._exposed),
        )

    def close(self) -> None:
        """Stops both streams."""
        self._pipeline.stop()


def _calibration(i: rs.intrinsics) -> CameraCalibration:
    return CameraCalibration(
        width=i.width,
        height=i.height,
        distortion_model=MODELS.get(i.model, str(i.model)),
        D=list(i.coeffs),
        K=[i.fx, 0.0, i.ppx, 0.0, i.fy, i.ppy, 0.0, 0.0, 1.0],
        R=np.eye(3).ravel(),
        P=[i.fx, 0.0, i.ppx, 0.0, 0.0, i.fy, i.ppy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )
