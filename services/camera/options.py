"""What the camera takes on its command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class CameraOptions:
    """Which camera plays; a RealSense where no recording is named."""

    recording: Path | None = None
    """MCAP file whose camera plays instead of a device."""
    camera: str = "overhead"
    """Name of the camera in the recording."""
    repeat: bool = True
    """The recording begins again when it is over."""
    serial: str = ""
    """Of the device; empty: the first one."""
