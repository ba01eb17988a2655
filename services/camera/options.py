"""What the camera takes on its command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class CameraOptions:
    """Which camera plays; a RealSense where no recording is named."""

    recording: Path | None = None
    """File whose camera plays instead of a device: an MCAP, or a .db3 or .bag of a RealSense."""
    camera: str = "overhead"
    """Name of the camera in an MCAP."""
    repeat: bool = True
    """An MCAP begins again when it is over; a RealSense's recording always does."""
    serial: str = ""
    """Of the device; empty: the first one."""
