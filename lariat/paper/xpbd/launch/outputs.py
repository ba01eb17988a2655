"""Launch outputs: roll-out and gradients, read from the buffers of a launch."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.paper.xpbd.launch.layout import Section
from lariat.paper.xpbd.launch.sizes import Sizes
from lariat.paper.xpbd.parameters import PARAMETERS
from lariat.rod.launch.buffers import LaunchBuffers
from lariat.rod.launch.grip_edges import fold_grips
from lariat.rod.results import Gradient, Rollout, StateGradient
from lariat.rod.state import RodState


def read_positions(buffers: LaunchBuffers[Sizes]) -> Float64[np.ndarray, "B H n 3"]:
    """Return the positions of all nodes after every step [m]."""
    every = buffers.sizes.substeps
    slots = buffers.section(Section.POSITIONS)
    chains = slots.reshape(len(slots), -1, buffers.sizes.nodes, 3)
    return chains[:, every::every, buffers.sizes.rod_nodes].copy()


def read_rollout(buffers: LaunchBuffers[Sizes], b: int) -> Rollout:
    """Return the roll-out of rod b of the batch.

    Sweeps are counted, not judged: `converged` says only that all numbers are finite.
    """
    n, every = buffers.sizes.nodes, buffers.sizes.substeps
    nodes = read_positions(buffers)[b]
    edges = buffers.section(Section.ORIENTATIONS)[b].reshape(-1, n - 1, 4)[every::every].copy()
    velocities = buffers.section(Section.VELOCITIES)[b, -3 * n :]
    angular_velocities = buffers.section(Section.ANGULAR_VELOCITIES)[b, -3 * (n - 1) :]
    return Rollout(
        nodes,
        edges,
        RodState(
            nodes[-1],
            edges[-1],
            velocities.reshape(n, 3)[buffers.sizes.rod_nodes].copy(),
            angular_velocities.reshape(n - 1, 3).copy(),
        ),
        np.full(len(nodes), buffers.sizes.iterations * every),
        np.isfinite(nodes).all(axis=(1, 2)),
    )


def read_gradient(buffers: LaunchBuffers[Sizes], b: int, parameters: tuple[str, ...]) -> Gradient:
    """Return the roll-out of rod b of the batch with the adjoint's gradient.

    Args:
        buffers: Buffers after the launch.
        b: Index in the batch.
        parameters: Names of the parameters, as requested.
    """
    n, clamps = buffers.sizes.nodes, buffers.sizes.clamps
    d_q = buffers.section(Section.D_ORIENTATIONS)[b].reshape(n - 1, 4)
    q = buffers.section(Section.ORIENTATIONS)[b, : 4 * (n - 1)].reshape(n - 1, 4)
    rotations = 0.5 * poses.multiply(d_q, poses.conjugate(q))[:, 1:]
    grips = buffers.section(Section.D_GRIPS)[b].reshape(2, 3)
    for grip, edge, clamped in zip(grips, (0, -1), clamps, strict=True):
        if clamped:
            rotations[edge] = grip
    state = StateGradient(
        fold_grips(buffers.section(Section.D_POSITIONS)[b].reshape(n, 3), clamps),
        rotations,
        fold_grips(buffers.section(Section.D_VELOCITIES)[b].reshape(n, 3), clamps),
        buffers.section(Section.D_ANGULAR_VELOCITIES)[b].reshape(n - 1, 3).copy(),
    )
    values = buffers.section(Section.D_PARAMETERS)[b]
    return Gradient(
        read_rollout(buffers, b),
        buffers.section(Section.D_ACTIONS)[b].reshape(-1, 2, 6).copy(),
        {name: float(values[PARAMETERS.index(name)]) for name in parameters},
        lambda: state,
    )
