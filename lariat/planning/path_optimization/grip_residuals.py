"""Residuals of a path that depend on the grips alone: effort, smoothness, distances, workspace."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grippers import axis_spacing
from lariat.geometry.grips import Grips
from lariat.planning.path_optimization.block_path import BlockDisplacements, BlockPath
from lariat.planning.problem import Problem
from lariat.safety.motion_contract import PATH_SPACING_MARGIN, PATH_WORKSPACE_MARGIN

MILLIMETRES = 1e3
"""Millimetres per metre."""
SMOOTHNESS_WEIGHT = 0.02
"""Weight of the change of displacement from block to block."""
EFFORT_WEIGHT = 0.01
"""Weight of the displacements."""
GRIP_DISTANCE_WEIGHT = 3.0
"""Weight of a distance of the grips, or of the grippers, outside its limits."""

Residuals = tuple[Float64[np.ndarray, "r"], Float64[np.ndarray, "r k 2 6"]]
"""Residuals, and their Jacobian with respect to the displacements."""


def grip_residuals(
    problem: Problem,
    path: BlockPath,
    displacements: BlockDisplacements,
    reserve: float,
) -> list[Residuals]:
    """Return all residuals of the grips, weighted, and their Jacobians.

    Args:
        problem: Limits, and which orientations are prescribed.
        reserve: Distance of the grippers beyond their limit [m].
    """
    # Lever arm that converts a rotation into a displacement: the rope's length over two pi.
    unit = np.where(np.arange(6) < 3, 1.0, problem.rod.properties.length / (2.0 * np.pi))
    unit = unit * MILLIMETRES
    scaled = _scaled_identity(len(displacements), unit)
    residuals = _motion_residuals(displacements, unit, scaled)
    whole = path.grips(displacements)
    residuals += [
        _orientation_residual(problem, unit[3:], path, whole, displacements, end)
        for end, oriented in enumerate(problem.goal.oriented)
        if oriented
    ]
    residuals += _distance_residuals(problem, path.share, whole[1:], reserve)
    return residuals + _workspace_residuals(problem, path.share, whole.positions[1:])


def _scaled_identity(
    blocks: int, unit: Float64[np.ndarray, "6"]
) -> Float64[np.ndarray, "k 2 6 k 2 6"]:
    """Jacobian of the displacements in their units."""
    identity = np.eye(blocks * 12).reshape(blocks, 2, 6, blocks, 2, 6)
    return identity * unit[None, None, :, None, None, None]


def _motion_residuals(
    displacements: BlockDisplacements,
    unit: Float64[np.ndarray, "6"],
    scaled: Float64[np.ndarray, "k 2 6 k 2 6"],
) -> list[Residuals]:
    """Effort, and smoothness from rest to rest."""
    padded = np.pad(displacements * unit, ((1, 1), (0, 0), (0, 0)))
    change = np.pad(scaled, ((1, 1), (0, 0), (0, 0), (0, 0), (0, 0), (0, 0)))
    size = (-1, len(displacements), 2, 6)
    return [
        (EFFORT_WEIGHT * (displacements * unit).ravel(), EFFORT_WEIGHT * scaled.reshape(size)),
        (
            SMOOTHNESS_WEIGHT * np.diff(padded, axis=0).ravel(),
            SMOOTHNESS_WEIGHT * np.diff(change, axis=0).reshape(size),
        ),
    ]


def _orientation_residual(
    problem: Problem,
    unit: Float64[np.ndarray, "3"],
    path: BlockPath,
    whole: Grips,
    displacements: BlockDisplacements,
    end: int,
) -> Residuals:
    """Rotation from the goal's orientation of one grip to that at the end of the path."""
    goal = problem.goal.grips[end].orientation
    residual = poses.rotation_from(goal, whole.orientations[-1, end])
    (twist,) = path.twists(whole, displacements, end, slice(-1, None))
    jacobian = np.zeros((3, len(displacements), 2, 6))
    jacobian[:, :, end, 3:] = unit[:, None, None] * twist[3:, :, 3:]
    return unit * residual, jacobian


def _distance_residuals(
    problem: Problem,
    share: Float64[np.ndarray, "s k"],
    grips: Grips,
    reserve: float,
) -> list[Residuals]:
    """Distances of the grips, and of the grippers' axes, outside their limits."""
    limits = problem.limits
    chord = grips.positions[:, 1] - grips.positions[:, 0]
    distance = np.linalg.norm(chord, axis=1)
    direction = chord / np.maximum(distance, 1e-9)[:, None]
    longest = problem.longest_grip_distance
    bodies = problem.gripper_distances(grips)
    spacing = axis_spacing(limits.gripper_radius, limits.keep_out)
    residuals = []
    for apart, towards, least, most in (
        (distance, direction, limits.spacing + PATH_SPACING_MARGIN, longest),
        (*bodies, spacing + reserve, np.inf),
    ):
        (bad,) = np.nonzero((apart > most) | (apart < least))
        if len(bad):
            excess = apart[bad] - np.clip(apart[bad], least, most)
            jacobian = np.zeros((len(bad), share.shape[1], 2, 6))
            pull = share[bad][:, :, None] * towards[bad][:, None, :]
            jacobian[:, :, 1, :3], jacobian[:, :, 0, :3] = pull, -pull
            weight = GRIP_DISTANCE_WEIGHT * MILLIMETRES
            residuals.append((weight * excess, weight * jacobian))
    return residuals


def _workspace_residuals(
    problem: Problem, share: Float64[np.ndarray, "s k"], positions: Float64[np.ndarray, "s 2 3"]
) -> list[Residuals]:
    """Positions of the grips outside the workspace."""
    low, high = np.array(problem.limits.workspace) + np.array(
        [[PATH_WORKSPACE_MARGIN], [-PATH_WORKSPACE_MARGIN]]
    )
    outside = positions - np.clip(positions, low, high)
    step, end, axis = np.nonzero(outside)
    if not len(step):
        return []
    jacobian = np.zeros((len(step), share.shape[1], 2, 6))
    jacobian[np.arange(len(step)), :, end, axis] = share[step]
    return [(MILLIMETRES * outside[step, end, axis], MILLIMETRES * jacobian)]
