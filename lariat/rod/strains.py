"""Internal forces, curvatures and moments of a rod."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod.rod import Rod
from lariat.rod.state import RodState


def forces(rod: Rod, state: RodState) -> Float64[np.ndarray, "n-1 3"]:
    """Return the internal force of each edge, world frame, tension along the edge positive [N].

    The force is EA (dx / l - d3). Stretch is stiff: a state that is off by the solver's tolerance
    t gives a force that is off by EA t / l.

    Args:
        rod: Rod with its material.
        state: State of that rod.
    """
    d3 = poses.rotate(state.orientations, np.array([0.0, 0.0, 1.0]))
    edges = np.diff(state.positions, axis=0)
    return rod.properties.stretch_stiffness * (edges / rod.edge_length - d3)


def curvatures(rod: Rod, state: RodState) -> Float64[np.ndarray, "n-2 3"]:
    """Return curvature about d1 and d2, and twist, at the inner nodes, in material frames [1/m].

    They are the rotation vector between neighbouring edges, per edge length.
    """
    relative = poses.multiply(poses.conjugate(state.orientations[:-1]), state.orientations[1:])
    return poses.logarithm(relative) / rod.edge_length


def moments(rod: Rod, state: RodState) -> Float64[np.ndarray, "n-2 3"]:
    """Return bending moments about d1 and d2, and twisting moment, at the inner nodes [N m]."""
    p, count = rod.properties, rod.node_count - 2
    stiffness = np.array([p.bending_stiffness, p.bending_stiffness, p.twisting_stiffness])
    strain = curvatures(rod, state) - p.rest_curvature_at(count)
    return p.profile_at(count)[:, None] * stiffness * strain
