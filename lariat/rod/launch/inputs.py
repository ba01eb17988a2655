"""Fills the arrays of a launch with what one or several rods are about to do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from jaxtyping import Float64, Int32, Int64

from lariat.geometry import poses
from lariat.rod.checks import check_launch, check_state
from lariat.rod.integration_schemes import HISTORY, time_table
from lariat.rod.launch.buffers import LaunchBuffers
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.kernel_launch import allocate
from lariat.rod.launch.layout import HISTORY_SLOTS, OBSTACLE_WIDTH, Header, Scalar, Section, TimeRow
from lariat.rod.launch.sizes import Sizes
from lariat.rod.obstacle_table import unpacked
from lariat.rod.parameters import numbered
from lariat.rod.so3 import left_jacobian
from lariat.rod.state import RodState, StateDirections

if TYPE_CHECKING:
    from lariat.rod.rod import Rod

End = Literal["free", "pinned", "clamped"]
"""How an end is held."""
ENDS: tuple[End, ...] = get_args(End)
HELD_BLOCKS = {"free": 0, "pinned": 1, "clamped": 3}
MAX_ITERATIONS = 1000
MAX_SAMPLES = 64
TOUCHES_PER_NODE, MOST_TOUCHES = 8, 512
"""Places for touches of the rod with itself."""
OVERSTRETCHED = 1.5
"""Distance between the ends of a state, in lengths, beyond which it is a mistake [-].

Below that it may be a rope that has been pulled, or whose length an estimate has too short.
"""


@dataclass(frozen=True)
class Wanted:
    """Which derivatives."""

    kinds: Derivatives = Derivatives(0)
    """Kinds of derivatives that are computed."""
    parameters: tuple[str, ...] = ()
    with_actions: bool = True
    """Whether sensitivities to actions are carried forward."""
    directions: Sequence[StateDirections] | None = None
    cost: Float64[np.ndarray, "B H n 3"] | None = None
    """Slope of the adjoint's cost in the positions."""


def opened(
    rod: Rod,
    states: Sequence[RodState],
    actions: Float64[np.ndarray, "B K 2 6"],
    dt: float | Float64[np.ndarray, "K"],
    steps: int | None = None,
    block_of_step: Int64[np.ndarray, "H"] | None = None,
    substeps: int = 1,
    obstacles: Float64[np.ndarray, "m 12"] | None = None,
    wanted: Wanted | None = None,
    *,
    carries: bool = True,
) -> LaunchBuffers[Sizes]:
    """A buffers that is ready to run; arguments as of `Rod.rollouts`.

    Args:
        carries: Whether velocity goes on from step to step.
    """
    wanted = Wanted() if wanted is None else wanted
    n = rod.node_count
    actions = np.asarray(actions, float)
    block_of_step = check_launch(len(states), actions, dt, steps, block_of_step, substeps)
    horizon, blocks = len(block_of_step), actions.shape[1]
    for state in states:
        check_state(state, n)
        away = state.positions[-1] - state.positions[0]
        apart = float(away @ away) ** 0.5
        if apart > OVERSTRETCHED * rod.properties.length:
            raise ValueError(
                f"the ends of the state are {apart:.4f} m apart but the rod is "
                f"{rod.properties.length} m long; bring them together"
            )
    columns = [d.checked(n) for d in wanted.directions or ()]
    if columns and len({len(d.positions) for d in columns} | {len(columns), len(states)}) > 2:
        raise ValueError("state_directions must be as many for each state")
    rows = np.zeros((0, OBSTACLE_WIDTH)) if obstacles is None else unpacked(obstacles)
    times = time_table(rod.scheme if carries else "still", dt, horizon, substeps)
    sizes = Sizes(
        len(states),
        n,
        len(times),
        horizon,
        blocks,
        len(rows),
        len(wanted.parameters),
        len(columns[0].positions) if columns else 0,
        2 * blocks if wanted.with_actions else 0,
        wanted.kinds,
        HISTORY[rod.scheme] if carries else 1,
        min(MOST_TOUCHES, TOUCHES_PER_NODE * n) if rod.self_contact else 0,
    )
    buffers = allocate(
        rod.buffer_pool, sizes, block_of_step, numbered(wanted.parameters, rod.properties)
    )
    integers = buffers.integers
    integers[Header.FIRST_FREE] = HELD_BLOCKS[rod.left]
    integers[Header.END_FREE] = 2 * n - 1 - HELD_BLOCKS[rod.right]
    integers[Header.LEFT_END] = ENDS.index(rod.left)
    integers[Header.RIGHT_END] = ENDS.index(rod.right)
    integers[Header.MAX_ITERATIONS] = MAX_ITERATIONS
    samples = math.ceil(2.0 * rod.edge_length / rod.properties.diameter)
    integers[Header.CONTACT_SAMPLES] = min(MAX_SAMPLES, max(1, samples))
    if rod.self_contact:
        _tell_touches(rod, integers)
    buffers.rods[:, : len(rod.constants)] = rod.constants
    if wanted.parameters:
        # What a step leaves unsolved counts a hundred times more in these derivatives.
        buffers.rods[:, Scalar.TOLERANCE] = 0.01 * rod.tolerance
    buffers.section(Section.TIMES)[:] = times.ravel()
    buffers.section(Section.ACTIONS)[:] = actions.reshape(sizes.batch, -1)
    _start(buffers, states)
    if wanted.kinds & Derivatives.SENSITIVITIES:
        buffers.section(Section.SENSITIVITIES)[:] = 0.0
        buffers.section(Section.SENSITIVITIES_OUT)[:] = 0.0
        h = float(times[0, TimeRow.DURATION])
        for b, (state, along) in enumerate(zip(states, columns, strict=False)):
            _start_columns(buffers, b, state, along, h)
    if wanted.kinds & Derivatives.ADJOINT:
        _start_adjoint(buffers, wanted.cost)
    buffers.obstacles()[:] = rows
    return buffers


def _tell_touches(rod: Rod, integers: Int32[np.ndarray, "k"]) -> None:
    edge, diameter = rod.edge_length, rod.properties.diameter
    integers[Header.SELF_CONTACT_SAMPLES] = min(8, max(1, math.ceil(edge / diameter)))
    # The tightest bend, a half circle of the rod's own radius, does not touch itself.
    apart = 0.5 * math.pi * (diameter + rod.properties.contact_margin)
    integers[Header.SELF_CONTACT_GAP] = 1 + max(2, math.ceil(apart / edge))


def _start(buffers: LaunchBuffers[Sizes], states: Sequence[RodState]) -> None:
    """Write the states where the kernel's `begin` makes history of them."""
    n = buffers.sizes.nodes
    positions = buffers.section(Section.POSITIONS)
    orientations = buffers.section(Section.ORIENTATIONS)
    new, old = HISTORY_SLOTS, HISTORY_SLOTS - 1
    for b, state in enumerate(states):
        x = positions[b, 3 * n * (old - 1) : 3 * n * new].reshape(2, n, 3)
        x[0], x[1] = state.velocities, state.positions
        q = orientations[b, 4 * (n - 1) * (old - 1) : 4 * (n - 1) * new].reshape(2, n - 1, 4)
        q[0, :, :3], q[1] = state.angular_velocities, state.orientations


def _start_adjoint(
    buffers: LaunchBuffers[Sizes], cost: Float64[np.ndarray, "B H n 3"] | None
) -> None:
    cost = np.asarray(cost, float)
    sizes = buffers.sizes
    if cost.shape != (sizes.batch, sizes.horizon, sizes.nodes, 3):
        raise ValueError(
            f"d_cost_d_positions must be ({sizes.horizon} steps, {sizes.nodes} nodes, 3), got "
            f"shape {cost.shape[1:]}"
        )
    if not np.isfinite(cost).all():
        raise ValueError("d_cost_d_positions holds a number that is not finite")
    for name in (Section.ADJOINT, Section.ACTIONS_OUT, Section.PARAMETERS_OUT):
        buffers.section(name)[:] = 0.0
    buffers.section(Section.COST_GRADIENT)[:] = cost.reshape(sizes.batch, -1)


def _start_columns(
    buffers: LaunchBuffers[Sizes], b: int, state: RodState, along: StateDirections, h: float
) -> None:
    """Write the directions into the sensitivities of the start and of the time before it."""
    n, sizes = buffers.sizes.nodes, buffers.sizes
    groups = -(-sizes.state_directions // 6)
    tail = np.zeros((6 * groups, HISTORY_SLOTS, 2 * n, 3))
    new, old = tail[: sizes.state_directions, -1], tail[: sizes.state_directions, 0]
    new[:, ::2], old[:, ::2] = along.positions, along.positions - h * along.velocities
    # Before the start an edge was at exp(-h omega) q.
    turned_by = left_jacobian(h * state.angular_velocities, along.angular_velocities)
    back = poses.conjugate(state.orientations)
    new[:, 1:-1:2] = poses.rotate(back, along.rotations)
    old[:, 1:-1:2] = poses.rotate(back, along.rotations - h * turned_by)
    tail[:, 1:-1] = tail[:, :1]
    rows = tail[:, :, :-1].reshape(groups, 6, HISTORY_SLOTS, 2 * n - 1, 3)
    rows = rows.transpose(0, 2, 3, 4, 1).reshape(groups, HISTORY_SLOTS, -1)
    columns = buffers.section(Section.SENSITIVITIES)[b].reshape(sizes.columns, -1, rows.shape[2])
    columns[-groups:, :HISTORY_SLOTS] = rows


def constants(rod: Rod) -> Float64[np.ndarray, "k"]:
    """Scalars, node masses and bends, in the order of their sections."""
    p, n, length = rod.properties, rod.node_count, rod.edge_length
    scalars = np.zeros(len(Scalar))
    scalars[Scalar.STRETCH_STIFFNESS] = p.stretch_stiffness
    scalars[Scalar.DAMPING] = p.damping
    scalars[Scalar.INTERNAL_DAMPING] = p.internal_damping
    scalars[Scalar.EDGE_LENGTH] = length
    scalars[Scalar.GRAVITY_X : Scalar.GRAVITY_Z + 1] = rod.gravity
    scalars[Scalar.CONTACT_STIFFNESS] = p.effective_contact_stiffness
    scalars[Scalar.CONTACT_REACH] = p.diameter / 2.0 + p.contact_margin
    scalars[Scalar.CONTACT_MARGIN] = p.contact_margin
    scalars[Scalar.TOLERANCE] = rod.tolerance
    scalars[Scalar.BENDING_STIFFNESS] = p.bending_stiffness
    scalars[Scalar.TWISTING_STIFFNESS] = p.twisting_stiffness
    scalars[Scalar.LINEAR_DENSITY] = p.linear_density
    # Of a solid cylinder: rho I = linear density times r^2 / 4, twice that about its axis.
    scalars[Scalar.BENDING_INERTIA] = p.linear_density * length * p.diameter**2 / 16.0
    scalars[Scalar.TWISTING_INERTIA] = 2.0 * scalars[Scalar.BENDING_INERTIA]
    masses = p.linear_density * length * p.density_at(n)
    masses[[0, -1]] *= 0.5
    bends = np.empty((n - 2, 6))
    bends[:, :2] = p.bending_stiffness / length
    bends[:, 2] = p.twisting_stiffness / length
    bends[:, :3] *= p.profile_at(n - 2)[:, None]
    bends[:, 3:] = p.rest_curvature_at(n - 2) * length
    return np.concatenate([scalars, masses, bends.ravel()])
