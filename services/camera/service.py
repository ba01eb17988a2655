"""Camera service: publishes exposures, stamped by the cell's clock."""

from __future__ import annotations

from collections.abc import Iterator

from services.camera.clock_offset import ClockOffset
from services.camera.options import CameraOptions
from services.camera.playback import Playback
from services.camera.source import CameraSource
from shared import topics
from shared.configuration import ConfigurationError
from shared.messages import timestamp
from shared.scenario import Scenario
from shared.service import SECOND, Inbox, Publication

COLOR = topics.CAMERA_COLOR.at(topics.CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(topics.CAMERA)
CALIBRATION = topics.CAMERA_CALIBRATION.at(topics.CAMERA)
REALSENSE_SUFFIXES = (".bag", ".db3")
"""Suffixes of recordings that the library of a RealSense plays."""
CALIBRATION_PERIOD = SECOND
"""Time between two calibration messages [ns]."""
SILENCE_TIMEOUT = SECOND
"""Time without an exposure after which the health reports it [ns]."""


class CameraService:
    """Real or recorded camera."""

    name = "camera"
    reads = ()
    writes = (COLOR, DEPTH, CALIBRATION)
    rate = 60.0
    latency = 0.0

    def __init__(self, source: CameraSource, latency: float) -> None:
        """Start without an exposure.

        Args:
            source: Source of the exposures.
            latency: Least time from exposure to arrival [s].
        """
        self._source = source
        self._clock = ClockOffset(round(latency * SECOND))
        self._last_arrival: int | None = None
        self._calibration_time = -CALIBRATION_PERIOD
        self.note = "waiting for the first exposure"

    def warm_up(self) -> None:
        """Do nothing: no code is compiled here."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Publish the newest exposure."""
        exposure = self._source.newest(now)
        if exposure is None:
            if self._last_arrival is not None and now - self._last_arrival > SILENCE_TIMEOUT:
                self.note = f"no exposure for {(now - self._last_arrival) / SECOND:.0f} s"
            return
        self._last_arrival = now
        stamp = self._clock.stamp(exposure.time, now)
        self.note = f"clock offset {(self._clock.offset or 0) / SECOND:.4f} s"
        for message in (exposure.color, exposure.depth, exposure.calibration):
            message.timestamp.CopyFrom(timestamp(stamp))
            message.frame_id = topics.CAMERA
        if now - self._calibration_time >= CALIBRATION_PERIOD:
            self._calibration_time = now
            yield Publication(CALIBRATION, exposure.calibration)
        yield Publication(COLOR, exposure.color)
        yield Publication(DEPTH, exposure.depth)

    def close(self) -> None:
        """Release the device or the file."""
        self._source.close()


def build(scenario: Scenario, session: str, options: CameraOptions | None = None) -> CameraService:
    """Build the camera of a scenario.

    Raises:
        ConfigurationError: The scenario has a simulated camera, or the source cannot be opened.
    """
    options = options or CameraOptions()
    sensing = scenario.sensing
    if sensing.source != "camera" or not sensing.outside:
        raise ConfigurationError(
            f"scenario {scenario.name!r} simulates its camera; set sensing.source = 'camera' "
            "and sensing.outside = true"
        )
    if options.recording is not None and options.recording.suffix not in REALSENSE_SUFFIXES:
        playback = Playback(options.recording, options.camera, options.repeat)
        return CameraService(playback, latency=0.0)
    # Imported here: an MCAP needs no library of a device.
    from services.camera.realsense import RealSense

    device = RealSense(options.serial, sensing.resolution, round(sensing.rate), options.recording)
    return CameraService(device, sensing.latency)
