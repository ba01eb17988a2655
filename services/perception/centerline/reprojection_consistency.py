"""Whether a chain and an image can both be true.

A chain that leaves bright pixels unexplained, or that runs where the camera sees past it, has the
wrong topology however well it fits the points that it was given.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt16

from lariat.geometry import polylines
from lariat.geometry.cameras import Camera
from services.perception.centerline.ridge import sampled
from services.perception.centerline.segmentation import Region

SEEN_PAST = 0.02
"""Depth behind the chain from which on the camera has looked past it [m]."""
IN_FRONT = 0.02
"""Depth before the chain from which on something else hides it [m]."""
SUBPIXEL = 4
"""Bits of the fixed-point coordinates that lines are drawn with."""


@dataclass(frozen=True)
class Agreement:
    """How far a chain and an image contradict each other."""

    unexplained: float
    """Part of the bright pixels away from the chain."""
    contradicted: float
    """Part of the chain where the camera sees what lies behind it."""
    covered: float
    """Part of the chain that something nearer hides."""

    def doubt(self, hidden: float) -> float:
        """0 where both agree, 1 and more where one is surely wrong.

        Args:
            hidden: Part of the chain that nothing was seen of. A rope that is in sight from end to
                end has no part left over for more bright pixels: they are something else.
        """
        share = min(1.0, hidden / 0.15)
        return share * self.unexplained / 0.04 + self.contradicted / 0.05


def agreement(
    nodes: Float64[np.ndarray, "n 3"],
    camera: Camera,
    region: Region,
    depth: UInt16[np.ndarray, "h w"],
    width: float,
) -> Agreement:
    """Compares a chain with an image.

    Args:
        nodes: Of the chain [m].
        camera: That took the image.
        region: Its bright part.
        depth: Of the whole image [mm].
        width: Of the rope [pixels].
    """
    dense = polylines.resampled(nodes, 4 * len(nodes))
    pixels, z = camera.project(dense)
    if not np.all(z > 0.0):
        return Agreement(1.0, 1.0, 0.0)
    local = pixels - np.array([region.left, region.top], float)
    drawn = np.zeros_like(region.mask)
    fixed = np.rint(np.clip(local, -1e4, 1e4) * 2**SUBPIXEL).astype(np.int32)
    thickness = max(3, round(1.3 * width + 3.0))
    cv2.polylines(drawn, [fixed[:, None]], False, 1, thickness, cv2.LINE_8, SUBPIXEL)
    bright = int(np.count_nonzero(region.mask))
    left_over = int(np.count_nonzero(region.mask & ~drawn & 1))

    reach = 2 * max(2, round(0.4 * width)) + 1
    near = cv2.dilate(region.mask, np.ones((reach, reach), np.uint8))
    at = np.rint(local).astype(int)
    height, across = region.mask.shape
    inside = (at >= 0).all(axis=1) & (at[:, 0] < across) & (at[:, 1] < height)
    clipped = np.clip(at, 0, [across - 1, height - 1])
    lit = inside & (near[clipped[:, 1], clipped[:, 0]] > 0)
    behind = sampled(depth, pixels)
    past = ~lit & (behind > z + SEEN_PAST)
    covered = ~lit & (behind > 0.0) & (behind < z - IN_FRONT)
    return Agreement(left_over / max(bright, 1), float(np.mean(past)), float(np.mean(covered)))
