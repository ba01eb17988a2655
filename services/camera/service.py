"""Puts a camera's exposures on the bus, stamped by the cell's clock."""

from __future__ import annotations

from collections.abc import Iterator

from services.camera.clock_offset import ClockOffset
from services.camera.options import CameraOptions
from services.camera.playback import Playback
from services.camera.source import Source
from shared import topics
from shared.configuration import ConfigurationError
from shared.messages import timestamp
from shared.scenario import Scenario
from shared.service import SECOND, Inbox, Publication

COLOR = topics.CAMERA_COLOR.at(topics.CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(topics.CAMERA)
CALIBRATION = topics.CAMERA_CALIBRATION.at(topics.CAMERA)
MAKERS = (".bag", ".db3")
"""Endings of recordings that a device's own library plays."""


class CameraService:
    """A camera from outside, in the place of the simulated one."""

    name = "camera"
    reads = ()
    writes = (COLOR, DEPTH, CALIBRATION)
    rate = 60.0
    latency = 0.0

    def __init__(self, source: Source, latency: float) -> None:
        """
        Args:
            source: Where exposures come from.
            latency: Least time from exposure to arrival [s].
        """
        self._source = source
        self._clock = ClockOffset(round(latency * SECOND))
        self._last: int | None = None
        self._calibrated = -SECOND
        self.note = "waiting for the first exposure"

    def warm_up(self) -> None:
        """Has nothing to compile."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Publishes the newest exposure."""
        shot = self._source.newest(now)
        if shot is None:
            if self._last is not None and now - self._last > SECOND:
                self.note = f"no exposure for {(now - self._last) / SECOND:.0f} s"
            return
        self._last = now
        stamp = self._clock.stamp(shot.exposed, now)
        self.note = f"clock offset {(self._clock.offset or 0) / SECOND:.4f} s"
        for message in (shot.color, shot.depth, shot.calibration):
            message.timestamp.CopyFrom(timestamp(stamp))
            message.frame_id = topics.CAMERA
        if now - self._calibrated >= SECOND:
            self._calibrated = now
            yield Publication(CALIBRATION, shot.calibration)
        yield Publication(COLOR, shot.color)
        yield Publication(DEPTH, shot.depth)

    def close(self) -> None:
        """Lets go of the device."""
        self._source.close()


def build(scenario: Scenario, session: str, options: CameraOptions | None = None) -> CameraService:
    """The camera of a scenario.

    Raises:
        ConfigurationError: The scenario has a simulated camera, or the source cannot be opened.
    """
    options = options or CameraOptions()
    sensing = scenario.sensing
    if sensing.source != "camera" or not sensing.outside:
        raise ConfigurationError(
            f"scenario {scenario.name!r} sees with its own camera; set sensing.source = 'camera' "
            "and sensing.outside = true"
        )
    devices = options.recording is None or options.recording.suffix in MAKERS
    if options.recording is not None and not devices:
        playback = Playback(options.recording, options.camera, options.repeat)
        return CameraService(playback, latency=0.0)
    # Only who has a device needs its library.
    from services.camera.realsense import RealSense

    device = RealSense(options.serial, sensing.resolution, round(sensing.rate), options.recording)
    return CameraService(device, sensing.latency)
