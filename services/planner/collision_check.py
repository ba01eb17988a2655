"""Collision check of a timed path: clearance of rope and grippers, and between the grippers."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grippers import axis_spacing, gripper_axis_distance, swept_gripper_points
from lariat.geometry.obstacles import segment_distance, signed_distance
from services.planner.problem import Problem
from shared.motion_contract import CHUNK_BOUNDARY_MARGIN


def path_clearance(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    nodes: Float64[np.ndarray, "t n 3"],
) -> float:
    """Return the least distance of rope and grippers from all obstacles along a path [m].

    Args:
        problem: Obstacles, and sizes of rope and grippers.
        positions: Positions of the grips [m].
        orientations: Orientations of the grips, wxyz.
        nodes: Nodes of the rope [m].
    """
    limits = problem.limits
    bodies = swept_gripper_points(positions, orientations, limits.gripper_reach)
    half = 0.5 * float(np.max(np.linalg.norm(np.diff(nodes, axis=1), axis=2)))
    least = np.inf
    for obstacle in problem.solid:
        least = min(least, np.min(signed_distance(bodies, obstacle)) - limits.gripper_radius)
    for obstacle in problem.obstacles:
        rough = signed_distance(nodes, obstacle) - problem.radius
        # A segment is nearer than its nodes by half its length at most.
        near = np.minimum(rough[:, :-1], rough[:, 1:])
        at, index = np.nonzero(near < min(least, np.min(rough)) + half)
        if len(at):
            exact = segment_distance(nodes[at, index], nodes[at, index + 1], obstacle)
            least = min(least, np.min(exact) - problem.radius)
    return float(least)


def gripper_overlap(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
) -> float:
    """Return the largest lack of distance between the grippers, beyond that at the start [m].

    Positive when they come too close to each other; arguments as in `path_clearance`.
    """
    limits = problem.limits
    bodies, _ = gripper_axis_distance(positions, orientations, limits.gripper_reach)
    grips = np.linalg.norm(positions[:, 1] - positions[:, 0], axis=1)
    spacing = axis_spacing(limits.gripper_radius, limits.keep_out)
    lacks = [spacing - bodies, limits.spacing + CHUNK_BOUNDARY_MARGIN - grips]
    return max(float(np.max(lack) - max(lack[0], 0.0)) for lack in lacks)
