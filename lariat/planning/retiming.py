"""Retiming: paths as the arms go them, checked for collisions.

Of several paces, the one after which the rope comes to rest soonest is chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import scene_distance
from lariat.geometry.polylines import with_midpoints
from lariat.planning.arms.arm_check import LINK_MARGIN, arm_fault
from lariat.planning.path_check import (
    MIN_CLEARANCE,
    fault_on_the_way,
    path_clearance,
    simulate_path,
)
from lariat.planning.path_optimization.optimizer import PathCandidate, PathOptimizer
from lariat.planning.problem import PATH_PERIOD, Problem, WholePath, grip_distance
from lariat.planning.time_parameterization import Pace, time_parameterize

PACES = (
    Pace(1.6, (0.4, 0.4)),
    Pace(1.3, (0.48, 0.4)),
    Pace(1.3, (0.4, 0.4)),
    Pace(1.0, (0.56, 0.4)),
    Pace(2.5, (0.4, 0.4)),
)
"""Paces, of which the one that comes to rest first is chosen. Likely ones are listed first, so
that most others need not be simulated to their end."""
CLOSE_PACES = (
    Pace(2.5, (0.16, 0.1)),
    Pace(1.3, (0.16, 0.1), 0.4),
    Pace(2.0, (0.16, 0.1), 0.1),
)
"""Paces that are tried when all others pass too close to obstacles: narrow running means deviate
less from the waypoints, and corners are passed slowly where there is little room."""
WAYPOINT_PACE = Pace(1.3, (0.4, 0.4))
"""Pace of waypoints from elsewhere; its running means hardly excite a hanging rope."""
SUFFICIENT_CLEARANCE = 0.7
"""Clearance above which a path is accepted, relative to the wanted one."""
NEGLIGIBLE_SWING = 2e-4
"""Amplitude below which a swing is negligible [m]."""
SWING_DURATION = 1.0
"""Duration that costs as much as a factor e of residual swing [s]."""
SLOWER = 0.6
"""Factor on the pace of a path along which a joint of an arm turns or speeds up too fast."""
MAX_SLOWER = 3
"""Largest number of times that such a path is slowed."""


def retime(
    optimizer: PathOptimizer,
    candidate: PathCandidate,
    link_margin: float = LINK_MARGIN,
    paces: Sequence[Pace] = PACES,
) -> WholePath:
    """Return the path of a candidate at the best of all paces at which its arms can go it.

    Args:
        link_margin: Distance that links of the arms keep beyond their limit [m].
    """
    share = optimizer.problem.pace
    path = _at_best_pace(optimizer, candidate, paces, share)
    fault = arm_fault(optimizer.problem, path, link_margin)
    for _ in range(MAX_SLOWER):
        if fault is None or fault.rule not in ("joint_speed", "joint_acceleration"):
            break
        share, before = SLOWER * share, fault
        path = _at_best_pace(optimizer, candidate, paces, share)
        fault = arm_fault(optimizer.problem, path, link_margin)
        if fault is not None and fault.rule == before.rule and fault.amount >= before.amount:
            # Joints jump, or wind through a singular pose, at any pace.
            break
    if fault is None:
        return path
    reason = path.reason or f"blocked: on every path found {fault}"
    return replace(path, reached=False, reason=reason, arm_fault=str(fault))


def path_through(problem: Problem, waypoints: Grips, pace: Pace = WAYPOINT_PACE) -> WholePath:
    """Return the path of the rope's ends through waypoints, as one from elsewhere is taken.

    Its `reason` says in words why it cannot be gone, with `blocked`, or how far from the goal it
    ends.
    """
    limits = problem.limits.scaled(problem.pace)
    grips = time_parameterize(waypoints, limits, PATH_PERIOD, pace)
    nodes, _ = simulate_path(problem, grips)
    end = nodes[-1]
    if not problem.goal.route:
        # What is laid has a history, and does not swing.
        end = problem.rest(grips.pair(-1), end).positions
    error = problem.goal_error(end)
    path = _path(problem, grips, nodes, error)
    blocked = fault_on_the_way(problem, path, min(MIN_CLEARANCE, problem.clearance))
    short = "" if error <= problem.tolerance else f"ends {1e3 * error:.1f} mm from the goal"
    reason = blocked or short
    return replace(path, reached=not reason, reason=reason, blocked=bool(blocked))


def _path(
    problem: Problem, grips: Grips, nodes: Float64[np.ndarray, "k n 3"], error: float
) -> WholePath:
    """Path with its clearance, before it is judged."""
    clearance = path_clearance(problem, grips, nodes)
    return WholePath(grips.positions, grips.orientations, nodes, True, "", error, clearance)


def _at_best_pace(
    optimizer: PathOptimizer, candidate: PathCandidate, paces: Sequence[Pace], share: float
) -> WholePath:
    """Path of a candidate with a share of the usual limits, at the best of all paces."""
    problem = optimizer.problem
    waypoints, limits = optimizer.grips(candidate), problem.limits.scaled(share)
    target = optimizer.wanted_clearance - max(candidate.shortfall, 0.0)
    best, least, room = None, (True, np.inf), None
    for k, pace in enumerate((*paces, *CLOSE_PACES)):
        if k >= len(paces) and not least[0]:
            break
        if k >= len(paces) and room is None:
            room = _room(optimizer, candidate)
        grips = time_parameterize(waypoints, limits, PATH_PERIOD, pace, room)
        cost = len(grips) * PATH_PERIOD
        if (False, cost) >= least:
            continue
        nodes, swing = simulate_path(problem, grips)
        cost += SWING_DURATION * np.log1p(swing / NEGLIGIBLE_SWING)
        if (False, cost) >= least:
            continue
        path = _path(problem, grips, nodes, candidate.error)
        close = path.clearance < SUFFICIENT_CLEARANCE * target
        if best is None or (close, cost) < least:
            best, least = path, (close, cost)
    assert best is not None
    fault = fault_on_the_way(problem, best, optimizer.required_clearance)
    reason = f"blocked: on every path found {fault}" if fault else _miss(problem, candidate.error)
    return replace(best, reached=not reason, reason=reason)


def _room(optimizer: PathOptimizer, candidate: PathCandidate) -> Float64[np.ndarray, "w"]:
    """Clearance of the rope at each waypoint, beyond what it needs [m]."""
    problem = optimizer.problem
    start = problem.state.positions[None]
    nodes = np.concatenate([start, candidate.nodes[: len(optimizer.grips(candidate)) - 1]])
    clearance = scene_distance(with_midpoints(nodes), problem.obstacles).min(axis=1)
    return np.maximum(clearance - problem.radius - optimizer.required_clearance, 0.0)


def _miss(problem: Problem, error: float) -> str:
    """Reason why a path that ends some error [m] from the goal misses it; empty if it does not."""
    if error <= problem.tolerance:
        return ""
    needed = grip_distance(problem.goal.grips)
    if needed > problem.longest_grip_distance:
        return (
            f"unreachable: the grips of the goal are {needed:.4f} m apart, and a path brings them "
            f"{problem.longest_grip_distance:.4f} m apart at most; bring them closer, or raise "
            "limits.overstretch"
        )
    return (
        f"unreachable: the nearest shape found is {1e3 * error:.1f} mm from the "
        f"goal on average (tolerance {1e3 * problem.tolerance:.1f} mm)"
    )
