"""Exposures of one camera on the topics of its name."""

from __future__ import annotations

from collections.abc import Iterator

from lariat.trajectory import SECOND
from services.camera.clock_offset import ClockOffset
from services.camera.source import CameraSource
from shared import topics
from shared.camera_messages import stamped
from shared.runtime.service import Publication

CALIBRATION_PERIOD = SECOND
"""Time between two calibration messages [ns]."""
SILENCE_TIMEOUT = SECOND
"""Time without an exposure after which the health reports it [ns]."""


class CameraStream:
    """Source of exposures, its clock and its topics."""

    def __init__(self, name: str, source: CameraSource, latency: float) -> None:
        """Start without an exposure; `latency` is the least time from exposure to arrival [s]."""
        self.name = name
        self._source = source
        self._clock = ClockOffset(round(latency * SECOND))
        self._color = topics.CAMERA_COLOR.at(name)
        self._depth = topics.CAMERA_DEPTH.at(name)
        self._calibration = topics.CAMERA_CALIBRATION.at(name)
        self.writes = (self._color, self._depth, self._calibration)
        self._last_arrival: int | None = None
        self._calibration_time = -CALIBRATION_PERIOD
        self.note = "waiting for the first exposure"
        """State of the source, in words."""

    def publish(self, now: int) -> Iterator[Publication]:
        """Publish the newest exposure, if there is one at `now` [ns]."""
        exposure = self._source.newest(now)
        if exposure is None:
            if self._last_arrival is not None and now - self._last_arrival > SILENCE_TIMEOUT:
                self.note = f"no exposure for {(now - self._last_arrival) / SECOND:.0f} s"
            return
        self._last_arrival = now
        stamp = self._clock.stamp(exposure.time, now)
        self.note = f"clock offset {(self._clock.offset or 0) / SECOND:.4f} s"
        for message in (exposure.color, exposure.depth, exposure.calibration):
            stamped(message, self.name, stamp)
        if now - self._calibration_time >= CALIBRATION_PERIOD:
            self._calibration_time = now
            yield Publication(self._calibration, exposure.calibration)
        yield Publication(self._color, exposure.color)
        yield Publication(self._depth, exposure.depth)

    def close(self) -> None:
        """Release the device or the file."""
        self._source.close()
