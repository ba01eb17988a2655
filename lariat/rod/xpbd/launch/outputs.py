"""Reads what a launch has left in its arrays."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod.launch.buffers import LaunchBuffers
from lariat.rod.state import RodState, Rollout, StateGradient
from lariat.rod.xpbd.launch.layout import Section
from lariat.rod.xpbd.launch.sizes import Sizes

PARAMETERS = ("mass", "inertia", "linear_damping", "angular_damping", "bending_compliance")
"""What derivatives can be taken of, line 2 of Algorithm 1; in the order of the kernel."""


def positions(buffers: LaunchBuffers[Sizes]) -> Float64[np.ndarray, "B H n 3"]:
    """Of all nodes after every step [m]."""
    every = buffers.sizes.substeps
    slots = buffers.section(Section.POSITIONS)
    return slots.reshape(len(slots), -1, buffers.sizes.nodes, 3)[:, every::every].copy()


def rolled(buffers: LaunchBuffers[Sizes], b: int) -> Rollout:
    """The roll-out of one rod of the batch.

    Sweeps are counted, not judged: `converged` says only that all numbers are finite.
    """
    n, every = buffers.sizes.nodes, buffers.sizes.substeps
    nodes = positions(buffers)[b]
    edges = buffers.section(Section.ORIENTATIONS)[b].reshape(-1, n - 1, 4)[every::every].copy()
    velocities = buffers.section(Section.VELOCITIES)[b, -3 * n :]
    turning = buffers.section(Section.ANGULAR_VELOCITIES)[b, -3 * (n - 1) :]
    return Rollout(
        nodes,
        edges,
        RodState(
            nodes[-1],
            edges[-1],
            velocities.reshape(n, 3).copy(),
            turning.reshape(n - 1, 3).copy(),
        ),
        np.full(len(nodes), buffers.sizes.iterations * every),
        np.isfinite(nodes).all(axis=(1, 2)),
    )


def slopes(
    buffers: LaunchBuffers[Sizes], b: int, clamped: tuple[bool, bool], parameters: tuple[str, ...]
) -> tuple[Float64[np.ndarray, "K 2 6"], StateGradient, dict[str, float]]:
    """Those in actions, initial state and parameters of one rod of the batch."""
    n = buffers.sizes.nodes
    d_q = buffers.section(Section.D_ORIENTATIONS)[b].reshape(n - 1, 4)
    q = buffers.section(Section.ORIENTATIONS)[b, : 4 * (n - 1)].reshape(n - 1, 4)
    rotations = 0.5 * poses.multiply(d_q, poses.conjugate(q))[:, 1:]
    grips = buffers.section(Section.D_GRIPS)[b].reshape(2, 3)
    for grip, edge, held in zip(grips, (0, -1), clamped, strict=True):
        if held:
            rotations[edge] = grip
    state = StateGradient(
        buffers.section(Section.D_POSITIONS)[b].reshape(n, 3).copy(),
        rotations,
        buffers.section(Section.D_VELOCITIES)[b].reshape(n, 3).copy(),
        buffers.section(Section.D_ANGULAR_VELOCITIES)[b].reshape(n - 1, 3).copy(),
    )
    values = buffers.section(Section.D_PARAMETERS)[b]
    return (
        buffers.section(Section.D_ACTIONS)[b].reshape(-1, 2, 6).copy(),
        state,
        {name: float(values[PARAMETERS.index(name)]) for name in parameters},
    )
