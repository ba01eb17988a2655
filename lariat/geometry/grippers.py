"""Body of a gripper, its cover by spheres, and the distances that others keep from this cover.

The body is a capsule along the z axis of the grip, which is the axis of the rope, away from the
rope. The gateway covers the capsule with spheres, at most one radius apart, whose radius is
therefore at most sqrt(1 + 1/4) = 1.118 of the capsule's. Planner and controller look at points on
the axis of the capsule instead; the functions here say how far these must stay away so that the
spheres do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

GRIPPER_COVER_RATIO = 1.12
"""Upper bound on the radius of the covering spheres, in radii of the capsule [-]."""
GRIPPER_CLEARANCE_MARGIN = 0.003
"""Clearance that the controller keeps beyond what the gateway demands of a gripper's body [m]."""
GRIPPER_SPACING_RATIO = 2.2
"""Planned distance of the axes of two grippers that touch, in radii of their capsules [-].

Two covers that touch are up to 2 * 1.118 radii apart; the margin below makes up the difference for
radii of up to 55 mm.
"""
GRIPPER_SPACING_MARGIN = 0.002
"""Distance that planned grippers keep from each other beyond what the gateway demands [m]."""


@dataclass(frozen=True)
class GripperBody:
    """Capsule in the frame of a grip."""

    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of one cap [m]."""
    end: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of the other cap [m]."""
    radius: float = 0.012
    """[m]"""

    @property
    def spheres(self) -> tuple[Float64[np.ndarray, "k 3"], float]:
        """Centres and radius of spheres that cover the capsule [m]."""
        start, end = np.array(self.start), np.array(self.end)
        length = float(np.linalg.norm(end - start))
        count = 1 + int(np.ceil(length / self.radius))
        gap = length / max(count - 1, 1)
        return np.linspace(start, end, count), float(np.hypot(self.radius, gap / 2.0))


def gripper_bodies(reach: float, radius: float) -> tuple[GripperBody, GripperBody]:
    """Return the bodies of the left and the right gripper, which point away from the rope.

    Args:
        reach: Distance from a grip to the centre of its capsule's far cap [m].
        radius: Radius of the capsules [m].
    """
    return (
        GripperBody(end=(0.0, 0.0, -reach), radius=radius),
        GripperBody(end=(0.0, 0.0, reach), radius=radius),
    )


def axis_clearance(radius: float, keep_out: float) -> float:
    """Return the distance that a gripper's axis keeps from obstacles [m].

    Args:
        radius: Radius of the capsule [m].
        keep_out: Least distance of a gripper's body from an obstacle [m].
    """
    return keep_out + GRIPPER_COVER_RATIO * radius + GRIPPER_CLEARANCE_MARGIN


def axis_spacing(radius: float, keep_out: float) -> float:
    """Return the distance that the axes of two grippers keep from each other [m].

    Args:
        radius: Radius of the capsules [m].
        keep_out: Least distance of two grippers' bodies [m].
    """
    return GRIPPER_SPACING_RATIO * radius + keep_out + GRIPPER_SPACING_MARGIN
