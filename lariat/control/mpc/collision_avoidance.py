"""Collision avoidance in the horizon: hinge penalties on missing clearance, cf. eq. (13).

The rope's nodes and edge midpoints keep a clearance from obstacles, and three points on the axis of
each gripper's body from obstacles and supports. Points with enough clearance contribute nothing, so
a goal near an obstacle stays unbiased.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grippers import swept_gripper_points
from lariat.geometry.near_pairs import NO_PAIRS, near_pairs
from lariat.geometry.obstacles import Obstacle, bounding_box, out_of_reach
from lariat.geometry.polylines import with_midpoints

MILLIMETRE = 1e3
"""Millimetres per metre: lengths enter the objective in millimetres."""
CLEARANCE_WEIGHT = 2.0
"""Weight of a millimetre of missing clearance against one of tracking error, per contact [-]."""


@dataclass(frozen=True)
class AvoidanceSpecification:
    """Obstacles, the clearances to keep from them, and limits on the rope's extension."""

    obstacles: tuple[Obstacle, ...]
    """Obstacles that the rope must not touch."""
    clearance: float
    """Distance to keep between the surfaces of rope and obstacles [m]."""
    radius: float
    """Radius of the rope [m]."""
    max_grip_distance: float
    """Maximum distance between the grips [m]; a constraint, not a term of the objective."""
    max_stretch: float = np.inf
    """Stretch of the rope that is allowed, as a share of its length at rest [-]; a constraint as
    well."""
    gripper_obstacles: tuple[Obstacle, ...] = ()
    """Obstacles that the grippers must not touch."""
    gripper_reach: float = 0.0
    """Distance from a grip to the centre of its capsule's far cap [m]."""
    gripper_clearance: float = 0.0
    """Distance to keep between a gripper's axis and its obstacles [m]."""


@dataclass(frozen=True)
class GripPrediction:
    """Grips over the steps of a horizon, left then right."""

    positions: Float64[np.ndarray, "h 2 3"]
    """Positions [m]."""
    orientations: Float64[np.ndarray, "h 2 4"]
    """Orientations, wxyz."""
    position_jacobian: Float64[np.ndarray, "h 2 3 v"]
    """Derivative of the positions with respect to the variables."""
    rotation_jacobian: Float64[np.ndarray, "h 2 3 v"]
    """Derivative of rotations about the world axes with respect to the variables."""


def rope_clearance_residuals(
    nodes: Float64[np.ndarray, "h n 3"],
    jacobian: Float64[np.ndarray, "h n 3 v"],
    avoidance: AvoidanceSpecification,
) -> tuple[Float64[np.ndarray, "c"], Float64[np.ndarray, "c v"]]:
    """Missing clearance of nodes and edge midpoints, and its Jacobian.

    Args:
        nodes: Predicted nodes [m].
        jacobian: Derivative of the nodes with respect to the variables.
        avoidance: Obstacles and clearances.
    """
    count, reach = nodes.shape[1], avoidance.clearance + avoidance.radius
    box = bounding_box(nodes)
    near = [o for o in avoidance.obstacles if not out_of_reach(box, o, reach)]
    hits = NO_PAIRS
    if near:
        points = with_midpoints(nodes).reshape(-1, 3)
        hits = near_pairs(points, near, np.full(len(points), reach))
    if not len(hits.points):
        return np.zeros(0), np.zeros((0, jacobian.shape[-1]))
    step, at = np.divmod(hits.points, 2 * count - 1)
    first = np.where(at < count, at, at - count)
    second = np.where(at < count, at, at - count + 1)
    here = 0.5 * (jacobian[step, first] + jacobian[step, second])
    along = np.einsum("ac,acv->av", hits.normals, here)
    weight = MILLIMETRE * CLEARANCE_WEIGHT
    return weight * (reach - hits.distances), -weight * along


def gripper_clearance_residuals(
    grips: GripPrediction, avoidance: AvoidanceSpecification
) -> tuple[Float64[np.ndarray, "c"], Float64[np.ndarray, "c v"]]:
    """Missing clearance of the grippers' bodies, and its Jacobian.

    Args:
        grips: Predicted grips.
        avoidance: Obstacles and clearances.
    """
    box, reach = bounding_box(grips.positions), avoidance.gripper_reach
    farthest = reach + avoidance.gripper_clearance
    near = [o for o in avoidance.gripper_obstacles if not out_of_reach(box, o, farthest)]
    bodies, hits = np.zeros((0, 3)), NO_PAIRS
    if near:
        bodies = swept_gripper_points(grips.positions, grips.orientations, reach)
        hits = near_pairs(bodies, near, np.full(len(bodies), avoidance.gripper_clearance))
    if not len(hits.points):
        return np.zeros(0), np.zeros((0, grips.position_jacobian.shape[-1]))
    # Points lie three to a gripper, two grippers to a step.
    step, end = np.divmod(hits.points // 3, 2)
    lever = bodies[hits.points] - grips.positions[step, end]
    along = np.einsum("ac,acv->av", hits.normals, grips.position_jacobian[step, end])
    along += np.einsum(
        "ac,acv->av", np.cross(lever, hits.normals), grips.rotation_jacobian[step, end]
    )
    weight = MILLIMETRE * CLEARANCE_WEIGHT
    return weight * (avoidance.gripper_clearance - hits.distances), -weight * along
