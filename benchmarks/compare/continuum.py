"""Motion and rest of the continuum, at the nodes of any rope.

In motion, a rod of many nodes in short steps of second order stands for it; at rest it is the
solution of the boundary value problem. Ropes with other nodes are compared at equal arc length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import make_interp_spline

from benchmarks.compare.motion import (
    ACTION_DURATION,
    LEFT_GRIP,
    PROPERTIES,
    RIGHT_GRIP,
    Moves,
    NodePath,
    final_grips,
)
from benchmarks.physics.continuum import Equilibrium, equilibrium
from lariat.rod import Rod, RolloutSpec

NODE_COUNT, SUBSTEPS = 321, 40
"""Number of nodes of the rod that stands for the continuum, and its sub-steps: 0.25 ms each."""


@dataclass(frozen=True)
class Continuum:
    """Motion and final rest shape of the continuum."""

    motion: Any
    """Spline of the positions after every action over s / L."""
    equilibrium: Equilibrium
    """Equilibrium between the grips at the end."""
    own_error_mm: float
    """Error of the motion itself, by Richardson's extrapolation: mean node distance [mm]."""

    def moving_errors(self, path: NodePath) -> Float64[np.ndarray, "H n"]:
        """Return the distance of every node from the continuum after every action [mm]."""
        there = np.moveaxis(self.motion(np.linspace(0.0, 1.0, path.shape[1])), 0, 1)
        return 1e3 * np.linalg.norm(path - there, axis=2)

    def rest_errors(self, positions: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n"]:
        """Return the distance of every node from the continuum at rest [mm]."""
        there = self.equilibrium.positions(len(positions))
        return 1e3 * np.linalg.norm(positions - there, axis=1)


def solve(moves: Moves) -> Continuum:
    """Return the continuum in motion and at rest."""
    fine, motion = _rollout(NODE_COUNT, SUBSTEPS, moves)
    coarse = _rollout(NODE_COUNT // 2 + 1, SUBSTEPS // 2, moves)[1].positions
    difference = np.linalg.norm(motion.positions[:, ::2] - coarse, axis=2).mean()
    left, right = final_grips(moves)
    rest = fine.rest(left, right, guess=motion.final).state
    arc = np.linspace(0.0, 1.0, NODE_COUNT)
    spline = make_interp_spline(arc, np.moveaxis(motion.positions, 1, 0), k=5)
    # Halved edges and steps divide an error of second order by four.
    return Continuum(spline, equilibrium(fine, left, right, rest), 1e3 * float(difference) / 3.0)


def _rollout(node_count: int, substeps: int, moves: Moves):
    rod = Rod(PROPERTIES, node_count, tolerance=1e-9, scheme="sdirk2")
    start = rod.rest(LEFT_GRIP, RIGHT_GRIP).state
    return rod, rod.rollout(RolloutSpec(start, moves, ACTION_DURATION, substeps=substeps))
