"""Command-line options of the camera service, beside those of every service."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class CameraOptions:
    """Source of the images: a RealSense, or a recording if one is named."""

    recording: Path | None = None
    """File to play instead of using a device: an MCAP, or a .db3 or .bag of a RealSense."""
    camera: str = ""
    """Name of the camera in an MCAP whose images the only camera of a scenario plays; by default
    its own name."""
    repeat: bool = True
    """Whether an MCAP starts again at its end; recordings of a RealSense always do."""
    serial: str = ""
    """Serial number of the device of the only camera; empty for the first one."""
