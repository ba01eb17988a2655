"""Bodies of grippers, their cover by spheres, and the distances to keep from this cover.

The body is a capsule along the z axis of the grip, which is the axis of the rope, away from the
rope. The gateway covers the capsule with spheres, at most one radius apart, whose radius is
therefore at most sqrt(1 + 1/4) = 1.118 of the capsule's. Planner and controller look at points on
the axis of the capsule instead; `axis_clearance` and `axis_spacing` return the distances that these
points must keep so that the spheres keep theirs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, capsule_between
from lariat.geometry.poses import Pose, rotate

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
    """Radius of the capsule [m]."""

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


def gripper_capsules(
    left: Pose | None, right: Pose | None, reach: float, radius: float
) -> list[Obstacle]:
    """Return the bodies of the grippers where they are.

    Args:
        left: Left grip; None without a gripper there.
        right: Right grip.
        reach: Distance from a grip to the centre of its capsule's far cap [m].
        radius: Radius of the capsules [m].
    """
    pairs = zip((left, right), gripper_bodies(reach, radius), strict=True)
    return [
        capsule_between(*grip.apply(np.array([body.start, body.end])), body.radius)
        for grip, body in pairs
        if grip is not None
    ]


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


def gripper_points(left: Pose, right: Pose, reach: float) -> Float64[np.ndarray, "6 3"]:
    """Return points on the axes of both grippers' capsules, which point away from the rope [m].

    Three points of the left capsule from the grip outwards, then three of the right one.

    Args:
        left: Left grip.
        right: Right grip.
        reach: Distance from a grip to the centre of its capsule's far cap [m].
    """
    along = reach * np.array([0.0, 0.5, 1.0])[:, None]
    axes = [rotate(p.orientation, np.array([0.0, 0.0, 1.0])) for p in (left, right)]
    return np.concatenate([left.position - along * axes[0], right.position + along * axes[1]])


def swept_gripper_points(
    positions: Float64[np.ndarray, "s 2 3"],
    orientations: Float64[np.ndarray, "s 2 4"],
    reach: float,
) -> Float64[np.ndarray, "p 3"]:
    """Return the `gripper_points` of a sequence of s pairs of grips, p = 6 s [m].

    Args:
        positions: Positions of the grips [m].
        orientations: Orientations of the grips, wxyz.
        reach: Distance from a grip to the centre of its capsule's far cap [m].
    """
    axes = rotate(orientations, np.broadcast_to(np.array([0.0, 0.0, 1.0]), positions.shape))
    outwards = np.array([-1.0, 1.0])[:, None, None]
    along = reach * np.array([0.0, 0.5, 1.0])[:, None]
    points = positions[:, :, None, :] + outwards * along * axes[:, :, None, :]
    return points.reshape(-1, 3)


def gripper_axis_distance(
    positions: Float64[np.ndarray, "s 2 3"],
    orientations: Float64[np.ndarray, "s 2 4"],
    reach: float,
) -> tuple[Float64[np.ndarray, "s"], Float64[np.ndarray, "s 3"]]:
    """Return the distance between the axes of both grippers' capsules, and its direction.

    The distance is that of the nearest pair of `gripper_points`.

    Args:
        positions: Positions of the grips [m].
        orientations: Orientations of the grips, wxyz.
        reach: Distance from a grip to the centre of its capsule's far cap [m].

    Returns:
        Distance [m], and unit vector from the left to the right gripper.
    """
    points = swept_gripper_points(positions, orientations, reach).reshape(-1, 2, 3, 3)
    offsets = (points[:, 1, None] - points[:, 0, :, None]).reshape(len(points), -1, 3)
    distances = np.linalg.norm(offsets, axis=-1)
    nearest = np.arange(len(points)), np.argmin(distances, axis=1)
    return distances[nearest], offsets[nearest] / np.maximum(distances[nearest], 1e-9)[:, None]
