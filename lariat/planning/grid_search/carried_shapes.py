"""Fixed shapes in which the rope is carried over the grid, without rotation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grippers import swept_gripper_points
from lariat.geometry.poses import Pose
from lariat.planning.grid_search.settings import GridSearchSettings
from lariat.planning.problem import Problem


@dataclass(frozen=True)
class CarriedShape:
    """Shape in which the rope is carried; positions are relative to the middle of the grips."""

    grips: Float64[np.ndarray, "2 3"]
    """Positions of the grips [m]."""
    orientations: Float64[np.ndarray, "2 4"]
    """Orientations of the grips, wxyz."""
    nodes: Float64[np.ndarray, "n 3"]
    """Nodes of the rope [m]."""
    gripper_points: Float64[np.ndarray, "6 3"]
    """Points on the axes of both grippers [m]."""


def carried_shapes(problem: Problem, settings: GridSearchSettings) -> list[CarriedShape]:
    """Return the current shape, the goal shape, then shapes at rest at several grip distances."""
    shapes = [
        _carried_shape(problem, problem.state.positions, problem.grips),
        _carried_shape(problem, problem.goal.nodes, problem.goal.grips),
    ]
    now, goal = problem.grips, problem.goal.grips
    halfway = [
        poses.multiply(
            poses.exponential(
                0.5 * poses.logarithm(poses.multiply(b.orientation, poses.conjugate(a.orientation)))
            ),
            a.orientation,
        )
        for a, b in zip(now, goal, strict=True)
    ]
    forward = np.array([0.0, 0.0, 1.0])
    pointing = sum(poses.rotate(q, forward) for q in halfway)
    headings: list[float] = []
    for chord in (pointing, now[1].position - now[0].position, goal[1].position - goal[0].position):
        heading = float(np.arctan2(chord[1], chord[0]))
        least = settings.min_heading_difference
        if all(abs(np.angle(np.exp(1j * (heading - h)))) > least for h in headings):
            headings.append(heading)
    for heading in headings:
        chord = problem.rod.properties.length * np.array([np.cos(heading), np.sin(heading), 0.0])
        for stretch in settings.stretches:
            left = Pose(-0.5 * stretch * chord, halfway[0])
            right = Pose(0.5 * stretch * chord, halfway[1])
            try:
                rest = problem.rod.rest(left, right)
            except ValueError:
                continue
            if rest.converged:
                shapes.append(_carried_shape(problem, rest.state.positions, (left, right)))
    return shapes


def middle_of(grips: tuple[Pose, Pose]) -> Float64[np.ndarray, "3"]:
    """Return the point in the middle of both grips [m]."""
    return 0.5 * (grips[0].position + grips[1].position)


def _carried_shape(
    problem: Problem, nodes: Float64[np.ndarray, "n 3"], grips: tuple[Pose, Pose]
) -> CarriedShape:
    middle = middle_of(grips)
    positions = np.stack([g.position for g in grips])
    orientations = np.stack([g.orientation for g in grips])
    grippers = problem.grippers(positions[None], orientations[None])
    bodies = swept_gripper_points(*grippers, problem.limits.gripper_reach)
    return CarriedShape(positions - middle, orientations, nodes - middle, bodies - middle)
