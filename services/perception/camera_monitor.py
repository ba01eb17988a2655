"""Detection of a silent, frozen or uncalibrated camera."""

from __future__ import annotations

from dataclasses import dataclass

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage


@dataclass(frozen=True)
class CameraMonitorSettings:
    """Times and counts after which a camera is reported as faulty."""

    frame_timeout: int = 300_000_000
    """Time without a frame after which the camera is reported as silent [ns]."""
    report_period: int = 250_000_000
    """Period at which silence is reported again [ns]."""
    calibration_timeout: int = 2_000_000_000
    """Time after the first frame within which a calibration must have arrived [ns]; cameras
    publish it every second."""
    frozen_frame_count: int = 8
    """Number of repeated frames after which the camera is reported as frozen: sensor noise makes
    every real frame different."""


class CameraMonitor:
    """Monitors the arrival and the repetition of the frames of one camera."""

    def __init__(self, name: str, settings: CameraMonitorSettings | None = None) -> None:
        self._name = name
        self._settings = settings or CameraMonitorSettings()
        self._first_frame: int | None = None
        self._last_frame: int | None = None
        self._reported = 0
        self._repeats = 0
        self._previous = (b"", b"")

    def silence(self, now: int) -> str:
        """Report silence in a step without a frame."""
        if self._last_frame is None:
            self._last_frame = now
        silence = now - self._last_frame
        due = now - self._reported >= self._settings.report_period
        if silence > self._settings.frame_timeout and due:
            self._reported = now
            return f"no frame of camera {self._name!r} for {silence / 1e9:.1f} s"
        return ""

    def frame_arrived(self, now: int) -> None:
        """Record the arrival of a frame at `now` [ns]."""
        self._last_frame = now
        if self._first_frame is None:
            self._first_frame = now

    def awaits_calibration(self, now: int) -> bool:
        """Whether the absence of a calibration is not yet a fault at `now` [ns]."""
        assert self._first_frame is not None
        return now - self._first_frame < self._settings.calibration_timeout

    def repeated(self, color: CompressedImage, depth: RawImage) -> bool:
        """Whether a frame is identical to the one before."""
        frame = (color.data, depth.data)
        self._repeats = self._repeats + 1 if frame == self._previous else 0
        self._previous = frame
        return self._repeats > 0

    def frozen(self) -> str:
        """Return the fault when too many frames in a row were identical, else ""."""
        if self._repeats < self._settings.frozen_frame_count:
            return ""
        return f"camera {self._name!r} is frozen: {self._repeats + 1} identical frames"
