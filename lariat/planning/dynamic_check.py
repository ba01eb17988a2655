"""Dynamic check of a timed path: the rope in motion, and its swing at the end."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.planning.problem import Problem
from lariat.rod import RolloutSpec

ROD_SUBSTEPS = 2
"""Number of substeps of the rod between two points of a path, sufficient for its swing."""
SWING_POINTS = 40
"""Number of points after the end during which the swing is measured."""


def simulate_path(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    dt: float,
) -> tuple[Float64[np.ndarray, "t n 3"], float]:
    """Return the nodes along a timed path, dynamics included, and the swing after it [m].

    Args:
        positions: Positions of the grips [m].
        orientations: Orientations of the grips, wxyz.
        dt: Time between points [s].
    """
    turns = poses.logarithm(poses.multiply(orientations[1:], poses.conjugate(orientations[:-1])))
    velocities = np.concatenate([np.diff(positions, axis=0), turns], axis=2) / dt
    actions = np.concatenate([velocities, np.zeros((SWING_POINTS, 2, 6))])
    nodes = problem.rod.rollout(
        RolloutSpec(
            problem.state, actions, dt, substeps=ROD_SUBSTEPS, obstacles=problem.packed_supports
        )
    ).positions
    after = nodes[-SWING_POINTS:]
    swing = float(np.max(np.linalg.norm(after - np.mean(after, axis=0), axis=2)))
    return np.concatenate([problem.state.positions[None], nodes[:-SWING_POINTS]]), swing
