"""Camera service: publishes the exposures of all cameras, stamped by the cell's clock."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from lariat.scenario.cameras import CameraSetup
from services.camera.options import CameraOptions
from services.camera.playback import Playback
from services.camera.source import CameraSource
from services.camera.stream import CameraStream
from shared import topics
from shared.runtime.service import Inbox, Publication
from shared.topics import Topic

REALSENSE_SUFFIXES = (".bag", ".db3")
"""Suffixes of recordings that the library of a RealSense plays."""


class CameraService:
    """Real or recorded cameras."""

    name = "camera"
    reads = ()
    writes: Sequence[Topic] = (
        topics.CAMERA_COLOR,
        topics.CAMERA_DEPTH,
        topics.CAMERA_CALIBRATION,
    )
    rate = 60.0
    latency = 0.0

    def __init__(self, streams: Sequence[CameraStream]) -> None:
        self._streams = streams
        self.writes = tuple(topic for stream in streams for topic in stream.writes)
        self._set_note()

    def warm_up(self) -> None:
        """Do nothing: no code is compiled here."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Publish the newest exposure of each camera."""
        for stream in self._streams:
            yield from stream.publish(now)
        self._set_note()

    def close(self) -> None:
        """Release the devices or the files."""
        for stream in self._streams:
            stream.close()

    def _set_note(self) -> None:
        single = len(self._streams) == 1
        self.note = "; ".join(s.note if single else f"{s.name}: {s.note}" for s in self._streams)


def build(scenario: Scenario, session: str, options: CameraOptions | None = None) -> CameraService:
    """Build the cameras of a scenario."""
    options = options or CameraOptions()
    sensing = scenario.sensing
    if sensing.source != "camera" or not sensing.outside:
        raise ConfigurationError(
            f"scenario {scenario.name!r} simulates its camera; set sensing.source = 'camera' "
            "and sensing.outside = true"
        )
    setups = scenario.camera_setups
    if len(setups) > 1 and (options.camera or options.serial or options.ros2):
        raise ConfigurationError(
            f"--camera, --serial and --ros2 are for a scenario with one camera, this one has "
            f"{len(setups)}; write each device to cameras.NAME.serial"
        )
    streams: list[CameraStream] = []
    try:
        for setup in setups:
            streams.append(_stream(scenario, setup, options))
    except ConfigurationError:
        for stream in streams:
            stream.close()
        raise
    return CameraService(streams)


def _stream(scenario: Scenario, setup: CameraSetup, options: CameraOptions) -> CameraStream:
    file = options.recording
    if options.ros2:
        # Imported here: other sources need no library of ROS 2's messages.
        from services.camera.ros2 import Ros2Camera

        source = Ros2Camera(*options.ros2, options.ros2_router, options.ros2_domain)
        return CameraStream(setup.name, source, scenario.sensing.latency)
    if file is not None and file.suffix not in REALSENSE_SUFFIXES:
        playback = Playback(file, options.camera or setup.name, options.repeat)
        return CameraStream(setup.name, playback, latency=0.0)
    if file is None and len(scenario.camera_setups) > 1 and not setup.serial:
        raise ConfigurationError(
            f"{setup.key}.serial is missing: with several real cameras each needs the serial "
            "number of its device"
        )
    # Imported here: an MCAP needs no library of a device.
    from services.camera.realsense import RealSense

    serial = options.serial or setup.serial
    rate = round(scenario.sensing.rate)
    device: CameraSource = RealSense(serial, setup.resolution, rate, file)
    return CameraStream(setup.name, device, scenario.sensing.latency)
