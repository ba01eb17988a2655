"""Consistency of a chain with the image and the depth that it was fitted to.

A chain that leaves rope pixels unexplained, or that passes in front of measured background, has the
wrong topology even if it fits its own points well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.cameras import Camera
from lariat.perception.centerline.observation import Observation
from lariat.perception.lines.ridge import sample_depth

SEE_THROUGH_DEPTH = 0.02
"""Distance behind the chain beyond which a measured depth contradicts it [m]."""
OCCLUDING_DEPTH = 0.02
"""Distance in front of the chain beyond which a measured depth belongs to an occluder [m]."""
EXPLAINING_HIDDEN_SHARE = 0.15
"""Hidden share of the chain above which unexplained pixels count in full."""
TOLERATED_UNEXPLAINED_SHARE = 0.04
"""Unexplained share of the rope pixels that corresponds to an inconsistency of one."""
TOLERATED_CONTRADICTED_SHARE = 0.05
"""Contradicted share of the chain that corresponds to an inconsistency of one."""
SUBPIXEL_BITS = 4
"""Fractional bits of the fixed-point coordinates of drawn lines."""


@dataclass(frozen=True)
class ReprojectionConsistency:
    """Inconsistency between a chain and an image."""

    unexplained: float
    """Share of the rope pixels away from the chain."""
    contradicted: float
    """Share of the chain behind which the camera measures background."""
    covered: float
    """Share of the chain in front of which the camera measures another object."""

    def inconsistency(self, hidden: float) -> float:
        """Return 0 for a consistent chain, 1 and more for a wrong one.

        Args:
            hidden: Share of the chain that was not observed. Further rope pixels beside a rope
                that is visible from end to end belong to something else.
        """
        share = min(1.0, hidden / EXPLAINING_HIDDEN_SHARE)
        return (
            share * self.unexplained / TOLERATED_UNEXPLAINED_SHARE
            + self.contradicted / TOLERATED_CONTRADICTED_SHARE
        )


def reprojection_consistency(
    nodes: Float64[np.ndarray, "n 3"],
    camera: Camera,
    view: Observation,
    others: Sequence[Float64[np.ndarray, "k 2"]] = (),
) -> ReprojectionConsistency:
    """Compare a chain with a frame.

    Args:
        nodes: Nodes of the chain [m].
        camera: Camera of the frame.
        view: Rope pixels of the image, depth and width of the rope.
        others: Axes of other ropes [pixels].
    """
    region, width = view.region, view.width
    dense = polylines.resample(nodes, 4 * len(nodes))
    pixels, z = camera.project(dense)
    if not np.all(z > 0.0):
        return ReprojectionConsistency(1.0, 1.0, 0.0)
    corner = np.array([region.left, region.top], float)
    local = pixels - corner
    drawn = np.zeros_like(region.mask)
    lines = [
        np.rint(np.clip(line, -1e4, 1e4) * 2**SUBPIXEL_BITS).astype(np.int32)[:, None]
        for line in (local, *(axis - corner for axis in others))
    ]
    thickness = max(3, round(1.3 * width + 3.0))
    cv2.polylines(drawn, lines, False, 1, thickness, cv2.LINE_8, SUBPIXEL_BITS)
    rope = int(np.count_nonzero(region.mask))
    unexplained = int(np.count_nonzero(region.mask & ~drawn & 1))

    reach = 2 * max(2, round(0.4 * width)) + 1
    near = cv2.dilate(region.mask, np.ones((reach, reach), np.uint8))
    at = np.rint(local).astype(int)
    height, across = region.mask.shape
    inside = (at >= 0).all(axis=1) & (at[:, 0] < across) & (at[:, 1] < height)
    clipped = np.clip(at, 0, [across - 1, height - 1])
    visible = inside & (near[clipped[:, 1], clipped[:, 0]] > 0)
    measured = sample_depth(view.depth, pixels)
    contradicted = ~visible & (measured > z + SEE_THROUGH_DEPTH)
    covered = ~visible & (measured > 0.0) & (measured < z - OCCLUDING_DEPTH)
    return ReprojectionConsistency(
        unexplained / max(rope, 1), float(np.mean(contradicted)), float(np.mean(covered))
    )
