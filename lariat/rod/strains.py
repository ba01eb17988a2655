"""Internal forces, curvatures and moments of a rod."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod.properties import RodProperties
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
    left, right = rod.model.clamps
    edges = state.orientations[left : len(state.orientations) - right]
    d3 = poses.rotate(edges, np.array([0.0, 0.0, 1.0]))
    stretched = np.diff(state.positions, axis=0) / rod.edge_length
    return rod.properties.stretch_stiffness * (stretched - d3)


def tensions(
    nodes: Float64[np.ndarray, "*b n 3"], properties: RodProperties
) -> Float64[np.ndarray, "*b n-1"]:
    """Return the tension of each edge of a rod, of which the nodes alone are known [N].

    It is EA (|dx| / l - 1): that of `forces` without shear, as far off as its tolerance says.

    Args:
        nodes: Nodes [m].
        properties: Material of the rod.
    """
    edges = np.linalg.norm(np.diff(nodes, axis=-2), axis=-1)
    length = properties.length / edges.shape[-1]
    return properties.stretch_stiffness * (edges / length - 1.0)


def curvatures(rod: Rod, state: RodState) -> Float64[np.ndarray, "m-1 3"]:
    """Return curvature about d1 and d2, and twist, in material frames [1/m].

    They are the rotation vectors between neighbouring frames per `RodModel.bend_lengths`, at the
    inner nodes and at clamps.
    """
    relative = poses.multiply(poses.conjugate(state.orientations[:-1]), state.orientations[1:])
    return poses.logarithm(relative) / rod.model.bend_lengths[:, None]


def moments(rod: Rod, state: RodState) -> Float64[np.ndarray, "m-1 3"]:
    """Return bending moments about d1 and d2, and twisting moment, where `curvatures` are [N m]."""
    p, places = rod.properties, rod.model.bend_places
    stiffness = np.array([p.bending_stiffness, p.bending_stiffness, p.twisting_stiffness])
    strain = curvatures(rod, state) - p.rest_curvature_at(places)
    return p.profile_at(places)[:, None] * stiffness * strain
