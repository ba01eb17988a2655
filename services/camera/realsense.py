"""Intel RealSense camera, through Intel's library, which the extra `camera` of the stack installs.

Recordings of that library (.db3, .bag) can be played in place of a device.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyrealsense2 as rs  # pyright: ignore[reportMissingImports]

from lariat.configuration import ConfigurationError
from services.camera.source import Exposure
from shared.camera_messages import calibration_message, color_message, depth_message

DISTORTION_MODELS = {
    rs.distortion.none: "plumb_bob",
    rs.distortion.brown_conrady: "plumb_bob",
    # Equal to the plumb bob for the small coefficients of these devices.
    rs.distortion.inverse_brown_conrady: "plumb_bob",
}
"""Names of Foxglove's distortion models, by those of the library."""


class RealSense:
    """Device whose depth is registered to colour by its library."""

    def __init__(
        self, serial: str, resolution: tuple[int, int], rate: int, recording: Path | None = None
    ) -> None:
        """Start both streams; an empty serial number takes the first device.

        A recording plays at its own resolution and rate [Hz].
        """
        self._pipeline = rs.pipeline()
        self._last_time = -1.0
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
            requested = f"camera {serial or '(any)'} at {width} x {height}, {rate} Hz"
            raise ConfigurationError(f"{recording or requested}: {error}") from error
        self._millimeters_per_unit = (
            1e3 * profile.get_device().first_depth_sensor().get_depth_scale()
        )
        self._align = rs.align(rs.stream.color)

    def newest(self, now: int) -> Exposure | None:
        """Return the newest exposure; None if there is none."""
        frames = self._pipeline.poll_for_frames()
        if not frames:
            return None
        frames = self._align.process(frames)
        color, depth = frames.get_color_frame(), frames.get_depth_frame()
        # A new depth image may come with the colour image of the previous exposure.
        if not color or not depth or color.get_timestamp() == self._last_time:
            return None
        self._last_time = color.get_timestamp()
        z = np.rint(np.asanyarray(depth.get_data()) * self._millimeters_per_unit)
        i = color.profile.as_video_stream_profile().intrinsics
        model = DISTORTION_MODELS.get(i.model, str(i.model))
        return Exposure(
            color_message(np.asanyarray(color.get_data())),
            depth_message(z.astype(np.uint16)),
            calibration_message((i.width, i.height), i.fx, i.fy, i.ppx, i.ppy, i.coeffs, model),
            round(1e6 * self._last_time),
        )

    def close(self) -> None:
        """Stop both streams."""
        self._pipeline.stop()
