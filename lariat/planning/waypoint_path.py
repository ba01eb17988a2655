"""Path through given waypoints: timed, simulated and checked as those of the searches are."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.planning.collision_check import MIN_CLEARANCE, fault_on_the_way, path_clearance
from lariat.planning.dynamic_check import simulate_path
from lariat.planning.problem import Problem, WholePath
from lariat.planning.retiming import PATH_PERIOD
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
        positions: Positions of the rope's ends [m].
        orientations: Their orientations, wxyz.
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
    least = min(MIN_CLEARANCE, problem.clearance)
    blocked = fault_on_the_way(problem, positions, orientations, nodes, clearance, least)
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
