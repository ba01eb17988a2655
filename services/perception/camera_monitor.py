"""Detection of a silent, frozen or uncalibrated camera."""

from __future__ import annotations

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

FRAME_TIMEOUT = 300_000_000
"""Time without a frame after which the camera is reported as silent [ns]."""
REPORT_PERIOD = 250_000_000
"""Period at which silence is reported again [ns]."""
CALIBRATION_TIMEOUT = 2_000_000_000
"""Time after the first frame within which a calibration must have arrived [ns]; cameras publish it
every second."""
FROZEN_FRAME_COUNT = 8
"""Number of repeated frames after which the camera is reported as frozen: sensor noise makes every
real frame different."""


class CameraMonitor:
    """Monitors the arrival and the repetition of the frames of one camera."""

    def __init__(self, name: str) -> None:
        self._name = name
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
        due = now - self._reported >= REPORT_PERIOD
        if silence > FRAME_TIMEOUT and due:
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
        return now - self._first_frame < CALIBRATION_TIMEOUT

    def repeated(self, color: CompressedImage, depth: RawImage) -> bool:
        """Whether a frame is identical to the one before."""
        frame = (color.data, depth.data)
        self._repeats = self._repeats + 1 if frame == self._previous else 0
        self._previous = frame
        return self._repeats > 0

    def frozen(self) -> str:
        """Return the fault when too many frames in a row were identical, else ""."""
        if self._repeats < FROZEN_FRAME_COUNT:
            return ""
        return f"camera {self._name!r} is frozen: {self._repeats + 1} identical frames"
