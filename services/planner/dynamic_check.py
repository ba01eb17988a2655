"""Puts a way on the clock: the pace after which the rope soonest rests, checked in motion."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grippers import axis_spacing, gripper_axis_distance, swept_gripper_points
from lariat.geometry.obstacles import segment_distance, signed_distance
from lariat.rod import RolloutSpec
from lariat.trajectory import NANOSECONDS
from services.planner.path_optimization import PathOptimisation, Trial
from services.planner.problem import Problem, WholePath
from services.planner.time_parameterization import Pace, timed
from shared.motion_contract import CHUNK_BOUNDARY_MARGIN, SETPOINT_PERIOD

DT = SETPOINT_PERIOD * NANOSECONDS
"""Between points of a path [s]."""
SUBSTEPS = 2
"""Of the rod between two points, so that it swings as it should."""
PACES = (
    Pace(1.6, (0.4, 0.4)),
    Pace(1.3, (0.48, 0.4)),
    Pace(1.3, (0.4, 0.4)),
    Pace(1.0, (0.56, 0.4)),
    Pace(2.5, (0.4, 0.4)),
    Pace(2.5, (0.16, 0.1)),
    Pace(4.0, (0.1, 0.05)),
)
"""The soonest after which the rope is still wins; the likeliest winners come first, so that others
need not be followed to their end. Narrow means cut the corners of the way less; the last ones are
only tried when the others pass too near to something."""
HURRIED = 5
"""So many may win by being sooner."""
ENOUGH = 0.7
"""Of the wanted clearance, with which a path is taken without looking for a better one."""
CALM = 2e-4
"""Swinging that does not matter [m]."""
CALMING = 1.0
"""What swinging e times as far costs [s]."""
AFTER = 40
"""Points after the end for which swinging is watched."""
LEAST_CLEARANCE = 0.005
"""Below this a path does not count [m]."""
SLACK = 5e-4
"""Clearance that may be missing [m]."""


def least_clearance(optimisation: PathOptimisation) -> float:
    """Of a path that counts [m]."""
    return min(LEAST_CLEARANCE, optimisation.wanted)


def on_the_clock(problem: Problem, optimisation: PathOptimisation, trial: Trial) -> WholePath:
    """The best of all paces."""
    ways = optimisation.grips(trial.displacements)
    best, least = None, (True, np.inf)
    for k, pace in enumerate(PACES):
        if k >= HURRIED and not least[0]:
            break
        positions, orientations = timed(*ways, problem.limits, DT, pace)
        cost = len(positions) * DT
        if (False, cost) >= least:
            continue
        nodes, swing = _moved(problem, positions, orientations)
        cost += CALMING * np.log1p(swing / CALM)
        if (False, cost) >= least:
            continue
        clearance = _clearance(problem, positions, orientations, nodes)
        close = clearance < ENOUGH * (optimisation.wanted - max(trial.shortfall, 0.0))
        if best is None or (close, cost) < least:
            best, least = (positions, orientations, nodes, clearance), (close, cost)
    assert best is not None
    positions, orientations, nodes, clearance = best
    reason = _reason(problem, trial, clearance, least_clearance(optimisation))
    crowded = _crowded(problem, positions, orientations)
    if crowded > 0.0:
        short = f"{1e3 * crowded:.1f} mm too near to each other"
        reason, clearance = f"blocked: on every way found the grippers come {short}", -crowded
    return WholePath(DT, positions, orientations, nodes, not reason, reason, trial.error, clearance)


def _crowded(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
) -> float:
    """By how much the grippers come nearer to each other than they may and than they begin [m]."""
    limits = problem.limits
    bodies, _ = gripper_axis_distance(positions, orientations, limits.gripper_reach)
    grips = np.linalg.norm(positions[:, 1] - positions[:, 0], axis=1)
    apart = axis_spacing(limits.gripper_radius, limits.keep_out)
    lacks = [apart - bodies, limits.spacing + CHUNK_BOUNDARY_MARGIN - grips]
    return max(float(np.max(lack) - max(lack[0], 0.0)) for lack in lacks)


def _reason(problem: Problem, trial: Trial, clearance: float, least: float) -> str:
    if clearance < least - SLACK:
        return (
            f"blocked: every way found comes within {1e3 * clearance:.1f} mm of an obstacle "
            f"({1e3 * least:.1f} mm needed)"
        )
    if trial.error > problem.tolerance:
        return (
            f"unreachable: the nearest shape found is {1e3 * trial.error:.1f} mm from the goal "
            f"on average (tolerance {1e3 * problem.tolerance:.1f} mm)"
        )
    return ""


def _moved(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
) -> tuple[Float64[np.ndarray, "t n 3"], float]:
    """The rope's nodes along a timed path, dynamics included, and its swinging after it [m]."""
    turns = poses.logarithm(poses.multiply(orientations[1:], poses.conjugate(orientations[:-1])))
    moving = np.concatenate([np.diff(positions, axis=0), turns], axis=2) / DT
    actions = np.concatenate([moving, np.zeros((AFTER, 2, 6))])
    nodes = problem.rod.rollout(
        RolloutSpec(
            problem.state, actions, DT, substeps=SUBSTEPS, obstacles=problem.packed_supports
        )
    ).positions
    after = nodes[-AFTER:]
    swing = float(np.max(np.linalg.norm(after - np.mean(after, axis=0), axis=2)))
    return np.concatenate([problem.state.positions[None], nodes[:-AFTER]]), swing


def _clearance(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    nodes: Float64[np.ndarray, "t n 3"],
) -> float:
    """Least distance of rope and gripper bodies from all obstacles [m]."""
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
