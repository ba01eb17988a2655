"""Check of a timed path: clearance of rope and grippers, between the grippers, and tension."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grippers import axis_spacing, gripper_axis_distance, swept_gripper_points
from lariat.geometry.obstacles import signed_distance
from lariat.geometry.swept_clearance import sweep_step, swept_clearance
from lariat.planning.problem import Problem
from lariat.rod.strains import tensions
from lariat.safety.motion_contract import CHUNK_BOUNDARY_MARGIN

MIN_CLEARANCE = 0.005
"""Clearance below which a path is blocked [m], unless start or goal have less."""
CLEARANCE_TOLERANCE = 5e-4
"""Lack of clearance that is accepted [m]."""


def path_clearance(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    nodes: Float64[np.ndarray, "t n 3"],
) -> float:
    """Return the least distance of rope and grippers from all obstacles along a path [m].

    The motion between two points counts too, so that nothing jumps over a thin body. Where the
    grippers come too close to each other, it is what they lack, negative.

    Args:
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
    overlap = gripper_overlap(problem, positions, orientations)
    return -overlap if overlap > 0.0 else float(least)


def fault_on_the_way(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    nodes: Float64[np.ndarray, "t n 3"],
    clearance: float,
    least: float,
) -> str:
    """Return in words why a timed path cannot be gone; empty where it can.

    Args:
        clearance: Its clearance [m]; other arguments as in `path_clearance`.
        least: Clearance that it needs [m].
    """
    overlap = gripper_overlap(problem, positions, orientations)
    if overlap > 0.0:
        return f"the grippers come {1e3 * overlap:.1f} mm too close to each other"
    limit = problem.limits.tension
    tension = float(np.max(tensions(nodes, problem.rod.properties)))
    if limit is not None and tension > limit:
        return f"the rope is pulled with {tension:.2f} N (limits.tension = {limit:g} N)"
    if clearance < least - CLEARANCE_TOLERANCE:
        return (
            f"rope or grippers come within {1e3 * clearance:.1f} mm of an obstacle "
            f"({1e3 * least:.1f} mm needed)"
        )
    return ""


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
