"""Fills the arrays of a launch with what one or several rods are about to do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64, Int64

from lariat.rod.checks import check_launch, check_state
from lariat.rod.launch.buffers import LaunchBuffers
from lariat.rod.launch.inputs import ENDS
from lariat.rod.launch.layout import OBSTACLE_WIDTH
from lariat.rod.obstacle_table import unpacked
from lariat.rod.state import RodState
from lariat.rod.xpbd.launch.kernel_launch import allocate
from lariat.rod.xpbd.launch.layout import Header, Scalar, Section
from lariat.rod.xpbd.launch.sizes import Sizes

if TYPE_CHECKING:
    from lariat.rod.xpbd.rod import XpbdRod

HELD_NODES = {"free": 0, "pinned": 1, "clamped": 2}


def opened(
    rod: XpbdRod,
    states: Sequence[RodState],
    actions: Float64[np.ndarray, "B K 2 6"],
    dt: float,
    steps: int | None,
    block_of_step: Int64[np.ndarray, "H"] | None,
    substeps: int,
    obstacles: Float64[np.ndarray, "m 12"] | None,
    *,
    taped: bool,
) -> LaunchBuffers[Sizes]:
    """All but a cost; arguments as of `XpbdRod.rollouts`.

    Args:
        taped: Whether derivatives will be asked for.
    """
    n = rod.node_count
    actions = np.asarray(actions, float)
    block_of_step = check_launch(len(states), actions, dt, steps, block_of_step, substeps)
    rows = np.zeros((0, OBSTACLE_WIDTH)) if obstacles is None else unpacked(obstacles)
    sizes = Sizes(
        len(states),
        n,
        len(block_of_step) * substeps,
        substeps,
        actions.shape[1],
        len(rows),
        rod.iterations,
        taped,
    )
    buffers = allocate(rod.buffer_pool, sizes, block_of_step)
    integers = buffers.integers
    integers[Header.FIRST_NODE] = HELD_NODES[rod.left]
    integers[Header.END_NODE] = n - HELD_NODES[rod.right]
    integers[Header.FIRST_EDGE] = rod.left == "clamped"
    integers[Header.END_EDGE] = n - 1 - (rod.right == "clamped")
    integers[Header.LEFT_END] = ENDS.index(rod.left)
    integers[Header.RIGHT_END] = ENDS.index(rod.right)
    buffers.rods[:, : len(rod.constants)] = rod.constants
    buffers.section(Section.SCALARS)[:, Scalar.STEP_DURATION] = dt / substeps
    buffers.section(Section.ACTIONS)[:] = actions.reshape(len(states), -1)
    for b, state in enumerate(states):
        check_state(state, n)
        for section, value in (
            (Section.POSITIONS, state.positions),
            (Section.ORIENTATIONS, state.orientations),
            (Section.VELOCITIES, state.velocities),
            (Section.ANGULAR_VELOCITIES, state.angular_velocities),
        ):
            buffers.section(section)[b, : value.size] = value.ravel()
    if taped:
        buffers.rods[:, buffers.places[Section.D_POSITIONS].start :] = 0.0
    buffers.obstacles()[:] = rows
    return buffers


def constants(rod: XpbdRod) -> Float64[np.ndarray, "k"]:
    """Scalars but for the step, and rest shape, in the order of their sections."""
    p = rod.properties
    scalars = np.zeros(len(Scalar))
    scalars[Scalar.EDGE_LENGTH] = rod.edge_length
    scalars[Scalar.GRAVITY_X : Scalar.GRAVITY_Z + 1] = rod.gravity
    scalars[Scalar.RADIUS] = p.diameter / 2.0
    scalars[Scalar.INVERSE_MASS] = 1.0 / p.mass
    scalars[Scalar.INVERSE_INERTIA] = 1.0 / p.inertia
    scalars[Scalar.LINEAR_DAMPING] = p.linear_damping
    scalars[Scalar.ANGULAR_DAMPING] = p.angular_damping
    scalars[Scalar.BENDING_COMPLIANCE] = p.bending_compliance
    scalars[Scalar.CONTACT_COMPLIANCE] = p.contact_compliance
    return np.concatenate([scalars, p.rest_darboux(rod.node_count).ravel()])
