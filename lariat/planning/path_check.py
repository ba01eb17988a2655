"""Check of a timed path: the rope in motion, its clearance and the grippers', and its tension."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grippers import axis_spacing
from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import signed_distance
from lariat.geometry.swept_clearance import sweep_step, swept_clearance
from lariat.planning.problem import PATH_PERIOD, Problem, WholePath
from lariat.rod import RolloutSpec
from lariat.rod.strains import tensions
from lariat.safety.motion_contract import CHUNK_BOUNDARY_MARGIN

MIN_CLEARANCE = 0.005
"""Clearance below which a path is blocked [m], unless start or goal have less."""
CLEARANCE_TOLERANCE = 5e-4
"""Lack of clearance that is accepted [m]."""
ROD_SUBSTEPS = 2
"""Number of substeps of the rod between two points of a path, sufficient for its swing."""
SWING_POINTS = 40
"""Number of points after the end during which the swing is measured."""


def simulate_path(problem: Problem, grips: Grips) -> tuple[Float64[np.ndarray, "k n 3"], float]:
    """Return the nodes along a timed path, dynamics included, and the swing after it [m].

    Args:
        grips: Grips at the points of the path.
    """
    nodes = driven(problem, grips, PATH_PERIOD, SWING_POINTS)
    after = nodes[-SWING_POINTS:]
    swing = float(np.max(np.linalg.norm(after - np.mean(after, axis=0), axis=2)))
    return nodes[:-SWING_POINTS], swing


def driven(
    problem: Problem,
    grips: Grips,
    dt: float,
    points_after: int = 0,
    substeps: int = ROD_SUBSTEPS,
) -> Float64[np.ndarray, "k n 3"]:
    """Return the nodes along a timed path and at as many points after it, dynamics included [m].

    Args:
        grips: Grips at the points of the path.
        dt: Time between two of them [s].
    """
    actions = np.concatenate([grips.steps() / dt, np.zeros((points_after, 2, 6))])
    nodes = problem.rod.rollout(
        RolloutSpec(
            problem.state, actions, dt, substeps=substeps, obstacles=problem.packed_supports
        )
    ).positions
    return np.concatenate([problem.state.positions[None], nodes])


def path_clearance(problem: Problem, grips: Grips, nodes: Float64[np.ndarray, "k n 3"]) -> float:
    """Return the least distance of rope and grippers from all obstacles along a path [m].

    The motion between two points counts too, so that nothing jumps over a thin body. Where the
    grippers come too close to each other, it is what they lack, negative.

    Args:
        grips: Grips at the points of the path.
        nodes: Nodes of the rope there [m].
    """
    radius = problem.limits.gripper_radius
    bodies = _densified(problem.gripper_points(grips), radius, problem)
    least = swept_clearance(nodes, problem.radius, problem.obstacles)
    for obstacle in problem.solid:
        least = min(least, np.min(signed_distance(bodies, obstacle)) - radius)
    overlap = gripper_overlap(problem, grips)
    return -overlap if overlap > 0.0 else float(least)


def fault_on_the_way(problem: Problem, path: WholePath, least: float) -> str:
    """Return in words why a timed path cannot be gone; empty where it can.

    Args:
        least: Clearance that it needs [m].
    """
    overlap = gripper_overlap(problem, path)
    if overlap > 0.0:
        return f"the grippers come {1e3 * overlap:.1f} mm too close to each other"
    limit = problem.limits.tension
    tension = float(np.max(tensions(path.nodes, problem.rod.properties)))
    if limit is not None and tension > limit:
        return f"the rope is pulled with {tension:.2f} N (limits.tension = {limit:g} N)"
    if path.clearance < least - CLEARANCE_TOLERANCE:
        return (
            f"rope or grippers come within {1e3 * path.clearance:.1f} mm of an obstacle "
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


def gripper_overlap(problem: Problem, grips: Grips) -> float:
    """Return the largest lack of distance between the grippers, beyond that at the start [m].

    Positive when they come too close to each other.
    """
    limits = problem.limits
    bodies, _ = problem.gripper_distances(grips)
    apart = np.linalg.norm(grips.positions[:, 1] - grips.positions[:, 0], axis=1)
    spacing = axis_spacing(limits.gripper_radius, limits.keep_out)
    lacks = [spacing - bodies, limits.spacing + CHUNK_BOUNDARY_MARGIN - apart]
    return max(float(np.max(lack) - max(lack[0], 0.0)) for lack in lacks)
