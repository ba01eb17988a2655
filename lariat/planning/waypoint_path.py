"""Path through given waypoints: timed, simulated and checked as those of the searches are."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.planning.collision_check import gripper_overlap, path_clearance
from lariat.planning.dynamic_check import simulate_path, tension_fault
from lariat.planning.problem import Problem, WholePath
from lariat.planning.retiming import PATH_PERIOD, RETIMING_SETTINGS
from lariat.planning.time_parameterization import Pace, time_parameterize
from lariat.rod import state_along

PACE = Pace(1.3, (0.4, 0.4))
"""Pace at which waypoints are passed; its running means hardly excite a hanging rope."""


def path_through(
    problem: Problem,
    positions: Float64[np.ndarray, "w 2 3"],
    orientations: Float64[np.ndarray, "w 2 4"],
    pace: Pace = PACE,
) -> WholePath:
    """Return the path through waypoints; its `reason` says in words why it cannot be gone, with
    `blocked`, or how far from the goal it ends.

    Args:
        problem: Planning problem.
        positions: Positions of the rope's ends [m].
        orientations: Their orientations, wxyz.
        pace: Speed, and smoothing of corners.
    """
    limits = problem.limits.scaled(problem.pace)
    positions, orientations = time_parameterize(positions, orientations, limits, PATH_PERIOD, pace)
    nodes, _ = simulate_path(problem, positions, orientations, PATH_PERIOD)
    end = nodes[-1]
    if not problem.goal.route:
        # What is laid has a history, and does not swing.
        grips = [poses.Pose(p, q) for p, q in zip(positions[-1], orientations[-1], strict=True)]
        guess = state_along(end, *orientations[-1])
        rest = problem.rod.rest(*grips, guess=guess, obstacles=problem.packed_supports)
        end = rest.state.positions
    error = problem.goal_error(end)
    clearance = path_clearance(problem, positions, orientations, nodes)
    overlap = gripper_overlap(problem, positions, orientations)
    least = min(RETIMING_SETTINGS.min_clearance, problem.clearance)
    blocked = tension_fault(problem, nodes)
    if overlap > 0.0:
        blocked = f"the grippers come {1e3 * overlap:.1f} mm too close to each other"
    elif clearance < least - RETIMING_SETTINGS.clearance_tolerance:
        blocked = (
            f"it comes within {1e3 * clearance:.1f} mm of an obstacle ({1e3 * least:.1f} mm needed)"
        )
    short = "" if error <= problem.tolerance else f"ends {1e3 * error:.1f} mm from the goal"
    return WholePath(
        PATH_PERIOD,
        positions,
        orientations,
        nodes,
        not blocked and not short,
        blocked or short,
        error,
        clearance,
        bool(blocked),
    )
