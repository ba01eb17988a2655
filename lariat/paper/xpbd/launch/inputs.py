"""Launch inputs: roll-out specifications, written into the buffers that the kernel reads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.paper.xpbd.launch.kernel_launch import allocate
from lariat.paper.xpbd.launch.layout import Header, Scalar, Section
from lariat.paper.xpbd.launch.sizes import Sizes
from lariat.paper.xpbd.model import XpbdRodModel
from lariat.rod.checks import check_rollout, check_state
from lariat.rod.launch.buffers import BufferPool, LaunchBuffers
from lariat.rod.launch.grip_edges import with_grips
from lariat.rod.launch.layout import OBSTACLE_WIDTH
from lariat.rod.model import ENDS
from lariat.rod.obstacle_table import kernel_rows
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.state import RodState

HELD_NODES = {"free": 0, "pinned": 1, "clamped": 2}
"""Nodes that each kind of end prescribes; two are those of a grip edge."""


def prepare(
    model: XpbdRodModel,
    constants: Float64[np.ndarray, "k"],
    pool: BufferPool,
    spec: RolloutSpec[RodState | Sequence[RodState]],
    *,
    with_tape: bool,
) -> LaunchBuffers[Sizes]:
    """Return buffers with all inputs of a launch except the seed of the adjoint.

    Args:
        model: The rod.
        constants: Its `pack_constants`.
        pool: Memory of the buffers.
        spec: Roll-out of one rod or of a batch.
        with_tape: Whether the launch records the tape of the adjoint.

    Raises:
        ValueError: The specification does not fit the rod or is out of its range.
    """
    n = model.frame_count + 1
    states, actions, substeps = spec.states, spec.batched_actions, spec.substeps
    block_of_step = check_rollout(spec, actions)
    empty = np.zeros((0, OBSTACLE_WIDTH))
    rows = empty if spec.obstacles is None else kernel_rows(spec.obstacles)
    sizes = Sizes(
        len(states),
        n,
        len(block_of_step) * substeps,
        substeps,
        actions.shape[1],
        len(rows),
        model.iterations,
        with_tape,
        model.clamps,
    )
    buffers = allocate(pool, sizes, block_of_step)
    integers = buffers.integers
    integers[Header.FIRST_NODE] = HELD_NODES[model.left]
    integers[Header.END_NODE] = n - HELD_NODES[model.right]
    integers[Header.FIRST_EDGE] = model.left == "clamped"
    integers[Header.END_EDGE] = n - 1 - (model.right == "clamped")
    integers[Header.LEFT_END], integers[Header.RIGHT_END] = (
        ENDS.index(model.left),
        ENDS.index(model.right),
    )
    buffers.rods[:, : len(constants)] = constants
    buffers.section(Section.SCALARS)[:, Scalar.STEP_DURATION] = spec.dt / substeps
    buffers.section(Section.ACTIONS)[:] = actions.reshape(len(states), -1)
    for b, state in enumerate(states):
        check_state(state, model.node_count, model.frame_count)
        for section, value in (
            (Section.POSITIONS, with_grips(state.positions, model.clamps)),
            (Section.ORIENTATIONS, state.orientations),
            (Section.VELOCITIES, with_grips(state.velocities, model.clamps)),
            (Section.ANGULAR_VELOCITIES, state.angular_velocities),
        ):
            buffers.section(section)[b, : value.size] = value.ravel()
    if with_tape:
        buffers.rods[:, buffers.places[Section.D_POSITIONS].start :] = 0.0
    buffers.obstacles()[:] = rows
    return buffers


def write_adjoint_seed(buffers: LaunchBuffers[Sizes], seed: Float64[np.ndarray, "B H n 3"]) -> None:
    """Write the gradient of a cost with respect to the positions [1/m].

    Raises:
        ValueError: The seed has the wrong shape.
    """
    sizes = buffers.sizes
    horizon = sizes.steps // sizes.substeps
    nodes = sizes.nodes - sum(sizes.clamps)
    if seed.shape != (sizes.batch, horizon, nodes, 3):
        raise ValueError(
            f"d_cost_d_positions must be ({horizon} steps, {nodes} nodes, 3), got shape "
            f"{seed.shape[1:]}"
        )
    chain = np.zeros((sizes.batch, horizon, sizes.nodes, 3))
    chain[:, :, sizes.rod_nodes] = seed
    buffers.section(Section.COST_GRADIENT)[:] = chain.reshape(sizes.batch, -1)


def pack_constants(model: XpbdRodModel) -> Float64[np.ndarray, "k"]:
    """Return scalars without the time step, and the rest shape, in the order of their sections."""
    p = model.properties
    scalars = np.zeros(len(Scalar))
    scalars[Scalar.EDGE_LENGTH] = model.edge_length
    scalars[Scalar.GRAVITY_X : Scalar.GRAVITY_Z + 1] = model.gravity
    scalars[Scalar.RADIUS] = p.diameter / 2.0
    scalars[Scalar.INVERSE_MASS] = 1.0 / p.mass
    scalars[Scalar.INVERSE_INERTIA] = 1.0 / p.inertia
    scalars[Scalar.LINEAR_DAMPING] = p.linear_damping
    scalars[Scalar.ANGULAR_DAMPING] = p.angular_damping
    scalars[Scalar.BENDING_COMPLIANCE] = p.bending_compliance
    scalars[Scalar.CONTACT_COMPLIANCE] = p.contact_compliance
    return np.concatenate([scalars, p.rest_darboux(model.bend_places, model.bend_lengths).ravel()])
