"""Sections of perception and its camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from lariat.configuration import Bounds, Extensible
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.scenario.sections.quantities import Color, Position, Quaternion, Side, Vector

PERCEPTION_METHODS = Extensible(("ridge", "paper"), "lariat.perception")
"""Methods that find the rope in images: `lariat.protocols.RopePerception`."""


@dataclass(frozen=True)
class FlangeMarker:
    """ArUco marker that moves with a grip, by which the camera's pose is calibrated."""

    marker: Annotated[int, Bounds(0, 49)]
    """Id of the marker (4x4_50)."""
    side: Side = "right"
    """Grip that carries it."""
    size: Annotated[float, Bounds(0.005, 1.0, "m")] = 0.04
    """Edge length of its black square."""
    position: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.03, 0.04)
    """Position of its centre in the grip's frame."""
    orientation: Quaternion = (0.5, -0.5, -0.5, -0.5)
    """Orientation of its frame (x right, y up, z out of its face) in the grip's frame; by
    default it faces along the grip's y."""

    def at(self, grip: Pose) -> Pose:
        """Return the marker's pose in the world for a pose of its grip."""
        return Pose(
            grip.apply(np.array(self.position)),
            poses.multiply(grip.orientation, poses.normalized(np.array(self.orientation))),
        )


def check_resolution(resolution: tuple[int, int]) -> None:
    """Check the size of images [pixels].

    Raises:
        ValueError: They are too small or too large.
    """
    if not all(64 <= count <= 4096 for count in resolution):
        raise ValueError(f"resolution = {list(resolution)} must lie in 64…4096 pixels")


@dataclass(frozen=True)
class Sensing:
    """Perception of the rope, and its camera."""

    source: Literal["truth", "camera"] = "truth"
    """Source of the rope's nodes; `camera`: images with depth."""
    method: Annotated[str, PERCEPTION_METHODS] = "ridge"
    """Method that finds the rope in images."""
    resolution: tuple[int, int] = (640, 480)
    """Width and height of the images in pixels."""
    field_of_view: Annotated[float, Bounds(10.0, 120.0, "deg")] = 65.0
    """Horizontal field of view."""
    position: Position = (0.0, -0.05, 1.0)
    """Position of the camera in the world."""
    look_at: Position = (0.0, 0.0, 0.15)
    """Point at which the camera looks."""
    orientation: Quaternion | None = None
    """Orientation of the optical frame (x right, y down, z forward), by `lariat calibrate`; it
    replaces `look_at`."""
    flange_marker: FlangeMarker | None = None
    rate: Annotated[float, Bounds(1.0, 120.0, "Hz")] = 30.0
    """Frame rate."""
    latency: Annotated[float, Bounds(0.0, 1.0, "s")] = 0.02
    """Time from exposure to the publication of an image."""
    node_noise: Annotated[float, Bounds(0.0, 0.1, "m")] = 0.0
    """Standard deviation of a node's coordinate, if `source` is `truth`."""
    depth_noise: Annotated[float, Bounds(0.0, 0.05, "m")] = 0.0015
    """Standard deviation of a pixel's depth in simulation."""
    depth_bias: Annotated[float, Bounds(-0.05, 0.05, "m")] = 0.0
    """Constant error of the depth in simulation."""
    depth_quantum: Annotated[float, Bounds(1e-5, 0.01, "m")] = 0.001
    """Quantisation step of the depth in simulation."""
    edge_dropout: Annotated[float, Bounds(0.0, 1.0)] = 0.5
    """Share of pixels at edges without depth in simulation."""
    threshold: Annotated[int, Bounds(1, 254)] = 128
    """Brightness, or likeness to `rope_color`, above which a pixel is rope."""
    rope_color: Color | None = None
    """Red, green, blue of the lit rope; by default its brightness tells it."""
    outside: bool = False
    """Whether a camera process publishes the images."""

    def __post_init__(self) -> None:
        check_resolution(self.resolution)
