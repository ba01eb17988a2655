"""Protocol of the perception of a rope: one RGB-D image in, nodes of the rope out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float64, UInt8, UInt16

from lariat.geometry.cameras import Camera
from lariat.geometry.poses import Pose


@dataclass(frozen=True)
class PerceptionSetup:
    """Facts that hold for the life of a perception."""

    camera: Camera
    """Intrinsics and pose of the camera; depth is registered to colour, without distortion."""
    length: float
    """Length of the rope between the grips [m]."""
    diameter: float
    """Diameter of the rope [m]."""
    node_count: int
    """Number n of nodes."""


@dataclass(frozen=True)
class RopeEstimate:
    """Nodes of the rope in one image."""

    nodes: Float64[np.ndarray, "n 3"]
    """Positions at equal distances along the rope, left end first [m]."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each position [m]."""
    observed: Bool[np.ndarray, "n"]
    """Nodes that are seen; the others are bridged."""


class RopePerception(Protocol):
    """Finder of one rope in successive images."""

    def __init__(self, setup: PerceptionSetup) -> None:
        """Create the perception of one camera; created anew when its calibration changes."""
        ...

    def reset(self) -> None:
        """Forget earlier images."""
        ...

    def locate(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        grips: tuple[Pose | None, Pose | None],
        time: float,
    ) -> RopeEstimate | None:
        """Return the rope in an image; None where it is not seen.

        Args:
            color: Red, green, blue.
            depth: Depth image [mm], 0 where nothing was measured.
            grips: Grips at the time of the exposure; None where one is unknown.
            time: Time of the exposure [s].
        """
        ...
