"""What a rod carries inside."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod.state import RodState

if TYPE_CHECKING:
    from lariat.rod.rod import Rod


def forces(rod: Rod, state: RodState) -> Float64[np.ndarray, "n-1 3"]:
    """Force that each edge passes on, in the world frame, tension along the edge positive [N].

    Stretch is stiff: a state that is off by its solver's tolerance t is off by EA t / l here.
    """
    d3 = poses.rotate(state.orientations, np.array([0.0, 0.0, 1.0]))
    edges = np.diff(state.positions, axis=0)
    return rod.properties.stretch_stiffness * (edges / rod.edge_length - d3)


def curvatures(rod: Rod, state: RodState) -> Float64[np.ndarray, "n-2 3"]:
    """Curvature about d1 and d2 and twist at the inner nodes, in the rod's own frame [1/m]."""
    turns = poses.multiply(poses.conjugate(state.orientations[:-1]), state.orientations[1:])
    return poses.logarithm(turns) / rod.edge_length


def moments(rod: Rod, state: RodState) -> Float64[np.ndarray, "n-2 3"]:
    """Bending moments about d1 and d2 and twisting moment at the inner nodes [N m]."""
    p, count = rod.properties, rod.node_count - 2
    stiffness = np.array([p.bending_stiffness, p.bending_stiffness, p.twisting_stiffness])
    strain = curvatures(rod, state) - p.rest_curvature_at(count)
    return p.profile_at(count)[:, None] * stiffness * strain
