"""Command-line options of the camera service, beside those of every service."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from shared.ros2.router import DEFAULT_ROUTER, environment_domain


@dataclass(frozen=True)
class CameraOptions:
    """Source of the images: a RealSense, a recording if one is named, or a ROS 2 camera."""

    recording: Path | None = None
    """File to play instead of using a device: an MCAP, or a .db3 or .bag of a RealSense."""
    camera: str = ""
    """Name of the camera in an MCAP whose images the only camera of a scenario plays; by default
    its own name."""
    repeat: bool = True
    """Whether an MCAP starts again at its end; recordings of a RealSense always do."""
    serial: str = ""
    """Serial number of the device of the only camera; empty for the first one."""
    ros2: tuple[str, str, str] | None = None
    """Topics of a ROS 2 camera instead: colour (Image, or CompressedImage in `…/compressed`), depth
    registered to it (16UC1 or 32FC1), and the CameraInfo of colour."""
    ros2_router: str = DEFAULT_ROUTER
    """Zenoh endpoint of ROS 2's router; where none answers, this process serves one there."""
    ros2_domain: int = field(default_factory=environment_domain)
    """Domain of its graph; by default ROS_DOMAIN_ID."""
