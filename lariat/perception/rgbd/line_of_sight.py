"""What a depth image tells of places at which a rope is remembered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, UInt16

from lariat.geometry.cameras import Camera

BEHIND_DISTANCE = 0.015
"""Distance behind a point from which a measured depth is of something behind it [m]."""
SAME_DISTANCE = 0.01
"""Distance from the surface of a rope within which a measured depth may be of it [m]."""


@dataclass(frozen=True)
class Sight:
    """What is seen at some points."""

    past: Bool[np.ndarray, "k"]
    """Whether something behind the point is seen: nothing is there."""
    there: Bool[np.ndarray, "k"]
    """Whether something is seen at the place of the point."""

    def __or__(self, other: Sight) -> Sight:
        """Return what two cameras see."""
        return Sight(self.past | other.past, self.there | other.there)


Look = Callable[[Float64[np.ndarray, "k 3"]], Sight]
"""Function that tells what is seen at some points [m]."""


def line_of_sight(
    points: Float64[np.ndarray, "k 3"],
    radius: float,
    depth: UInt16[np.ndarray, "h w"],
    camera: Camera,
) -> Sight:
    """Return what a depth image shows at points of a rope's axis.

    Args:
        points: Points in the world [m].
        radius: Radius of the rope [m].
        depth: Depth image [mm], 0 where nothing was measured.
        camera: Camera of the image.
    """
    pixels, z = camera.project(points)
    at = np.rint(pixels)
    height, width = depth.shape
    inside = (z > 0.0) & (at >= 1.0).all(axis=1) & (at < [width - 1, height - 1]).all(axis=1)
    column, row = np.where(inside[:, None], at, 1.0).astype(int).T
    around = [depth[row + r, column + c] for r in (-1, 0, 1) for c in (-1, 0, 1)]
    past = inside & (np.min(around, axis=0) > 1e3 * (z + BEHIND_DISTANCE))
    surface = 1e-3 * depth[row, column]
    return Sight(past, inside & (np.abs(surface - (z - radius)) < SAME_DISTANCE))
