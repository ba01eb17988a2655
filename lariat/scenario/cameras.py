"""Cameras of a cell: `[cameras.NAME]` of a scenario, or the only one, which `[sensing]` places."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from lariat.configuration import Bounds, ConfigurationError
from lariat.geometry import poses
from lariat.geometry.cameras import Intrinsics, looking_at
from lariat.geometry.poses import Pose
from lariat.scenario.sections import Position, Quaternion, Sensing, check_resolution

DEFAULT_CAMERA = "overhead"
"""Name of the camera that `[sensing]` places."""
MAX_CAMERAS = 8
"""Largest number of cameras."""
CAMERA_NAME = re.compile(r"[a-z][a-z0-9_-]{0,31}")
"""Form of a camera's name, which is part of topics and the name of a frame."""
RESERVED_NAMES = (
    "world",
    "left",
    "right",
    "rope",
    "truth",
    "prediction",
    "path",
    "goal",
    "obstacles",
)
"""Names of other frames and of other point clouds of a recording."""


@dataclass(frozen=True)
class PlacedCamera:
    """Camera by its name, in place of the one that `[sensing]` places."""

    position: Position
    """Position of the camera in the world."""
    look_at: Position = (0.0, 0.0, 0.15)
    """Point at which the camera looks."""
    orientation: Quaternion | None = None
    """Orientation of the optical frame (x right, y down, z forward) in the world, as found by
    `lariat calibrate`; it replaces `look_at`."""
    resolution: tuple[int, int] | None = None
    """Width and height of its images in pixels; by default `sensing.resolution`."""
    field_of_view: Annotated[float, Bounds(10.0, 120.0, "deg")] | None = None
    """Its horizontal field of view; by default `sensing.field_of_view`."""
    serial: str = ""
    """Serial number of the device, if `sensing.outside`; by default any device."""

    def __post_init__(self) -> None:
        if self.resolution is not None:
            check_resolution(self.resolution)


@dataclass(frozen=True)
class CameraSetup:
    """Camera of a cell with everything that the scenario says of it."""

    name: str
    """Name, which is part of its topics and the name of its frame."""
    T_world_camera: Pose
    """Pose of the optical frame as the stack assumes it."""
    resolution: tuple[int, int]
    """Width and height of its images [pixels]."""
    field_of_view: float
    """Horizontal field of view [deg]."""
    key: str
    """Section of the file that places it."""
    calibrated: bool
    """Whether its orientation was measured."""
    serial: str = ""
    """Serial number of the device; empty for any."""

    @property
    def intrinsics(self) -> Intrinsics:
        """Pinhole of the simulated camera."""
        return Intrinsics.symmetric(*self.resolution, math.radians(self.field_of_view))


def camera_setups(sensing: Sensing, cameras: Mapping[str, PlacedCamera]) -> tuple[CameraSetup, ...]:
    """Return the cameras of a cell, in the order of the file.

    Args:
        sensing: Section with the settings of all cameras, and the place of the only one.
        cameras: Cameras by name; empty for the only one.
    """
    placed = cameras or {DEFAULT_CAMERA: sensing}
    return tuple(
        CameraSetup(
            name,
            _pose(camera),
            camera.resolution or sensing.resolution,
            camera.field_of_view or sensing.field_of_view,
            key=f"cameras.{name}" if cameras else "sensing",
            calibrated=camera.orientation is not None,
            serial=getattr(camera, "serial", ""),
        )
        for name, camera in placed.items()
    )


def check_cameras(sensing: Sensing, cameras: Mapping[str, PlacedCamera]) -> None:
    """Check names and number of the cameras, and that each is placed once.

    Raises:
        ConfigurationError: They contradict each other; the text says how.
    """
    if not cameras:
        return
    if len(cameras) > MAX_CAMERAS:
        raise ConfigurationError(f"{len(cameras)} cameras, more than {MAX_CAMERAS}; remove some")
    for name in cameras:
        if not CAMERA_NAME.fullmatch(name) or name in RESERVED_NAMES:
            raise ConfigurationError(
                f"[cameras.{name}]: a camera's name is of a-z, 0-9, _ and -, begins with a letter "
                f"and is none of {', '.join(RESERVED_NAMES)}; rename it"
            )
    for key in ("position", "look_at", "orientation"):
        if getattr(sensing, key) != getattr(Sensing(), key):
            raise ConfigurationError(
                f"sensing.{key} places the only camera, but there is [cameras.{next(iter(cameras))}"
                f"]; move it to the section of its camera, e.g. [cameras.{DEFAULT_CAMERA}]"
            )


def _pose(camera: PlacedCamera | Sensing) -> Pose:
    if camera.orientation is None:
        return looking_at(camera.position, camera.look_at)
    return Pose(np.array(camera.position), poses.normalized(np.array(camera.orientation)))
