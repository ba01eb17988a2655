"""Energy of a rod, and the power of its left or right clamp."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod import Rod, RodState, curvatures, forces, moments
from lariat.rod.so3 import left_jacobian


def energy(rod: Rod, state: RodState) -> float:
    """Return kinetic, elastic and gravitational energy of a rod without contact [J]."""
    return kinetic(rod, state) + elastic(rod, state) + gravitational(rod, state)


def kinetic(rod: Rod, state: RodState) -> float:
    """Return the kinetic energy of nodes and edges [J]."""
    p = rod.properties
    left, right = rod.model.clamps
    edges = slice(left, len(state.orientations) - right)
    spins = poses.rotate(
        poses.conjugate(state.orientations[edges]), state.angular_velocities[edges]
    )
    # Second moments of a solid cylinder per length.
    inertia = p.linear_density * p.diameter**2 / 16.0 * np.array([1.0, 1.0, 2.0])
    turning = 0.5 * rod.edge_length * np.sum(inertia * spins**2)
    moving = 0.5 * np.sum(_masses(rod)[:, None] * state.velocities**2)
    return float(moving + turning)


def elastic(rod: Rod, state: RodState) -> float:
    """Return the energy of stretch, shear, bending and twist [J]."""
    p, places = rod.properties, rod.model.bend_places
    force = forces(rod, state)
    stretch = 0.5 * rod.edge_length * np.sum(force**2) / p.stretch_stiffness
    strains = curvatures(rod, state) - p.rest_curvature_at(places)
    bend = 0.5 * np.sum(rod.model.bend_lengths[:, None] * moments(rod, state) * strains)
    return float(stretch + bend)


def gravitational(rod: Rod, state: RodState) -> float:
    """Return the energy of the weight [J]."""
    return -float(_masses(rod) @ state.positions @ np.asarray(rod.model.gravity))


def clamp_load(rod: Rod, state: RodState, end: int) -> Float64[np.ndarray, "6"]:
    """Return force and moment that a clamp applies to a rod at rest, world frame [N, N m]."""
    bend = -end
    local = moments(rod, state)[bend]
    angles = rod.model.bend_lengths[bend] * curvatures(rod, state)[bend]
    # A turn of the grip changes the rotation vector by the inverse Jacobian of SO(3).
    jacobian_transposed = left_jacobian(np.tile((1.0 - 2.0 * end) * angles, (3, 1)), np.eye(3))
    turned = np.linalg.solve(jacobian_transposed, local)
    moment = poses.rotate(state.orientations[bend], turned)
    sign = 2.0 * end - 1.0
    return sign * np.concatenate([forces(rod, state)[bend], moment])


def _masses(rod: Rod) -> Float64[np.ndarray, "n"]:
    p = rod.properties
    masses = p.linear_density * rod.edge_length * p.density_at(rod.node_count)
    masses[[0, -1]] *= 0.5
    return masses
