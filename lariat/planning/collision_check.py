"""Collision check of a timed path: clearance of rope and grippers, and between the grippers."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grippers import axis_spacing, gripper_axis_distance, swept_gripper_points
from lariat.geometry.obstacles import signed_distance
from lariat.geometry.swept_clearance import sweep_step, swept_clearance
from lariat.planning.problem import Problem
from lariat.safety.motion_contract import CHUNK_BOUNDARY_MARGIN


def path_clearance(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    nodes: Float64[np.ndarray, "t n 3"],
) -> float:
    """Return the least distance of rope and grippers from all obstacles along a path [m].

    The motion between two points counts too, so that nothing jumps over a thin body.

    Args:
        problem: Obstacles, and sizes of rope and grippers.
        positions: Positions of the grips [m].
        orientations: Orientations of the grips, wxyz.
        nodes: Nodes of the rope [m].
    """
    limits = problem.limits
    grippers = problem.grippers(positions, orientations)
    bodies = swept_gripper_points(*grippers, limits.gripper_reach)
    bodies = _densified(bodies.reshape(len(positions), 6, 3), limits.gripper_radius, problem)
    least = swept_clearance(nodes, problem.radius, problem.obstacles)
    for obstacle in problem.solid:
        least = min(least, np.min(signed_distance(bodies, obstacle)) - limits.gripper_radius)
    return float(least)


def _densified(
    points: Float64[np.ndarray, "t p 3"], radius: float, problem: Problem
) -> Float64[np.ndarray, "s p 3"]:
    """Points along straight lines between their given places, close enough for every body."""
    moves = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1, initial=0.0)
    counts = np.maximum(np.ceil(moves / sweep_step(radius, problem.solid)), 1.0).astype(int)
    if np.all(counts == 1):
        return points
    at = np.concatenate([k + np.arange(c) / c for k, c in enumerate(counts)] + [[len(counts)]])
    first = np.minimum(at.astype(int), len(counts) - 1)
    share = (at - first)[:, None, None]
    return (1.0 - share) * points[first] + share * points[first + 1]


def gripper_overlap(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
) -> float:
    """Return the largest lack of distance between the grippers, beyond that at the start [m].

    Positive when they come too close to each other; arguments as in `path_clearance`.
    """
    limits = problem.limits
    grippers = problem.grippers(positions, orientations)
    bodies, _ = gripper_axis_distance(*grippers, limits.gripper_reach)
    grips = np.linalg.norm(positions[:, 1] - positions[:, 0], axis=1)
    spacing = axis_spacing(limits.gripper_radius, limits.keep_out)
    lacks = [spacing - bodies, limits.spacing + CHUNK_BOUNDARY_MARGIN - grips]
    return max(float(np.max(lack) - max(lack[0], 0.0)) for lack in lacks)
