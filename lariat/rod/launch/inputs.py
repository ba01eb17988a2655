"""Launch inputs: roll-out specifications, written into the buffers that the kernel reads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64, Int32

from lariat.geometry import poses
from lariat.rod.checks import check_durations, check_rollout, check_span, check_state
from lariat.rod.friction import carried_slips
from lariat.rod.integration_schemes import HISTORY_LENGTHS, time_table
from lariat.rod.launch.buffers import BufferPool, LaunchBuffers
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.grip_edges import with_grips
from lariat.rod.launch.kernel_launch import allocate
from lariat.rod.launch.layout import (
    COLUMNS_WIDTH,
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    MODEL_HEADER,
    OBSTACLE_WIDTH,
    Header,
    ObstacleRow,
    ParameterCode,
    Scalar,
    Section,
    TimeRow,
)
from lariat.rod.launch.sizes import Sizes
from lariat.rod.model import ENDS, ImplicitRodModel
from lariat.rod.obstacle_table import kernel_rows
from lariat.rod.parameters import parameter_codes
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.so3 import left_jacobian
from lariat.rod.state import RodState, StateDirections

HELD_BLOCKS = {"free": 0, "pinned": 1, "clamped": 3}
"""Blocks of three unknowns that each kind of end prescribes; three are those of a grip edge."""
MAX_ITERATIONS = 1000
"""Newton iterations after which a solve counts as failed."""
MAX_EDGE_SAMPLES = 64
"""Most points of an edge that are tested for contact with obstacles."""
MAX_STRAND_SAMPLES = 8
"""Most points of an edge that are tested for contact with other edges."""
SELF_CONTACTS_PER_NODE, MAX_SELF_CONTACTS = 8, 512
"""Capacity for self-contacts: per node, and in all."""
FRICTION_TOLERANCE_FACTOR = 0.1
"""Factor on the tolerance of a solve with friction, whose slips are as small as it [-]."""
DERIVATIVE_TOLERANCE_FACTOR = 0.01
"""Factor on the tolerance of a solve when derivatives in parameters are requested [-]."""

NO_OBSTACLES = np.zeros((0, OBSTACLE_WIDTH))
"""Rows of an empty scene."""


@dataclass(frozen=True)
class DerivativeRequest:
    """Derivatives that a launch computes beside the roll-out."""

    kinds: Derivatives = Derivatives(0)
    """Kinds of derivatives."""
    parameters: tuple[str, ...] = ()
    """Names of the parameters."""
    with_actions: bool = True
    """Whether forward sensitivities with respect to actions are computed."""
    directions: Sequence[StateDirections] | None = None
    """Directions of each initial state for forward sensitivities."""
    d_cost_d_positions: Float64[np.ndarray, "B H n 3"] | None = None
    """Seed of the adjoint [1/m]."""


class Constants(NamedTuple):
    """Numbers of every launch that depend on the rod alone."""

    doubles: Float64[np.ndarray, "k"]
    """Scalars, node masses, bends and layers, in the order of their sections."""
    integers: Int32[np.ndarray, "c"]
    """Integers at `MODEL_HEADER`."""
    layers: int
    """Layers of each bend that yield."""


NO_DERIVATIVES = DerivativeRequest()
"""Request of a roll-out alone."""


def prepare(
    model: ImplicitRodModel,
    constants: Constants,
    pool: BufferPool,
    spec: RolloutSpec[RodState | Sequence[RodState]],
    request: DerivativeRequest = NO_DERIVATIVES,
    durations: Float64[np.ndarray, "H"] | None = None,
    yields_last: bool = False,
) -> LaunchBuffers[Sizes]:
    """Return buffers with all inputs of a launch.

    Args:
        model: The rod.
        constants: Its `pack_constants`.
        pool: Memory of the buffers.
        spec: Roll-out of one rod or of a batch.
        request: Derivatives to compute.
        durations: Duration of each step, which replaces `spec.dt`, for steps that lose all velocity
            and decrease the energy alone [s]; None for steps with inertia.
        yields_last: Whether bends keep after the last of these steps alone what they keep beyond
            the initial state, whatever shapes lie on the way.

    Raises:
        ValueError: The specification does not fit the rod or is out of its range.
    """
    states, actions = spec.states, spec.batched_actions
    block_of_step = check_rollout(spec, actions)
    horizon, blocks = len(block_of_step), actions.shape[1]
    for state in {id(state): state for state in states}.values():
        check_state(state, model.node_count, model.frame_count, constants.layers)
        check_span(state, model.properties.length)
    directions = request.directions or ()
    for direction in directions:
        direction.check(model.node_count, model.frame_count)
    if directions:
        counts = {len(d.positions) for d in directions}
        if len(counts) > 1 or len(directions) != len(states):
            raise ValueError("state_directions must be equally many for each state")
    rows = NO_OBSTACLES if spec.obstacles is None else kernel_rows(spec.obstacles)
    if durations is None:
        times = time_table(model.scheme, spec.dt, horizon, spec.substeps)
        history = HISTORY_LENGTHS[model.scheme]
    else:
        check_durations(durations, blocks)
        times, history = time_table("still", durations, horizon, spec.substeps), 1
        if yields_last:
            times[:-1, TimeRow.YIELDS] = 0.0
    sizes = Sizes(
        len(states),
        model.frame_count + 1,
        len(times),
        horizon,
        blocks,
        len(rows),
        len(request.parameters),
        len(directions[0].positions) if directions else 0,
        blocks if request.with_actions else 0,
        request.kinds,
        history,
        min(MAX_SELF_CONTACTS, SELF_CONTACTS_PER_NODE * model.node_count)
        if model.self_contact
        else 0,
        model.clamps,
        _friction_pairs(model, rows, constants),
        constants.layers,
    )
    names = request.parameters
    codes = parameter_codes(names, model.properties) if names else None
    for name, code in zip(names, () if codes is None else codes, strict=True):
        if code[0] == ParameterCode.FRICTION and code[1] >= len(rows):
            raise ValueError(f"there are {len(rows)} obstacles, got {name!r}")
    buffers = allocate(pool, sizes, block_of_step, constants.integers, codes)
    if not pool.keeps(buffers, constants, times, rows, names):
        buffers.rods[:, : len(constants.doubles)] = constants.doubles
        if names:
            # Residuals of the steps affect these derivatives more than they affect positions.
            buffers.rods[:, Scalar.TOLERANCE] = DERIVATIVE_TOLERANCE_FACTOR * model.tolerance
        if sizes.friction_pairs:
            buffers.rods[:, Scalar.TOLERANCE] *= FRICTION_TOLERANCE_FACTOR
        buffers.section(Section.TIMES)[:] = times.ravel()
        if len(rows):
            buffers.obstacles()[:] = rows
    buffers.once(_action_place)[:] = actions
    for place, state in zip(buffers.once(_start_places), states, strict=True):
        place.write(state)
    if sizes.friction_pairs:
        _write_slips(buffers, model, states, spec.obstacles, directions)
    if sizes.layers:
        _write_sets(buffers, states, directions)
    if request.kinds:
        _write_derivative_inputs(buffers, request, states, float(times[0, TimeRow.DURATION]))
    return buffers


def _friction_pairs(
    model: ImplicitRodModel, rows: Float64[np.ndarray, "m 18"], constants: Constants
) -> int:
    """Return the number of slips; zero where no body has friction."""
    if not np.any(rows[:, ObstacleRow.FRICTION]):
        return 0
    samples = int(constants.integers[Header.CONTACT_SAMPLES - MODEL_HEADER.start])
    return len(rows) * (model.node_count - 1) * samples


def _write_slips(
    buffers: LaunchBuffers[Sizes],
    model: ImplicitRodModel,
    states: Sequence[RodState],
    bodies: Float64[np.ndarray, "m 13"] | None,
    directions: Sequence[StateDirections],
) -> None:
    """Write the slips of the initial states, and their sensitivities."""
    bodies = np.asarray(bodies, float)
    pairs, edges = buffers.sizes.friction_pairs, model.node_count - 1
    samples = pairs // (edges * len(bodies))
    radius = 0.5 * model.properties.diameter
    for row, state in zip(buffers.section(Section.SLIPS), states, strict=True):
        slips = carried_slips(state.contact, state.positions, radius, bodies, samples)
        row[: 3 * pairs] = slips.ravel()
    if buffers.sizes.derivatives & Derivatives.SENSITIVITIES:
        columns = buffers.section(Section.SLIP_SENSITIVITIES)
        columns[:] = 0.0
        buffers.section(Section.SLIP_STAMPS)[:] = -1.0
        for b, along in enumerate(directions):
            _write_columns(columns[b], buffers.sizes.columns, along.slips)
    if buffers.sizes.derivatives & Derivatives.ADJOINT:
        buffers.section(Section.SLIP_ADJOINT)[:] = 0.0


def _write_columns(
    columns: Float64[np.ndarray, "k"], groups: int, along: Float64[np.ndarray, "D ..."] | None
) -> None:
    """Write directions of slips or sets into the last of some groups of columns."""
    if along is None:
        return
    group_count = -(-len(along) // GROUP_COLUMNS)
    rows = np.zeros((group_count * GROUP_COLUMNS, along[0].size // 3, 3))
    rows[: len(along)] = along.reshape(len(along), -1, 3)
    rows = rows.reshape(group_count, GROUP_COLUMNS, -1, 3).transpose(0, 2, 3, 1)
    columns.reshape(groups, -1, 3, GROUP_COLUMNS)[-group_count:] = rows


def _write_sets(
    buffers: LaunchBuffers[Sizes], states: Sequence[RodState], directions: Sequence[StateDirections]
) -> None:
    """Write what layers of the bends keep in the initial states, and its sensitivities."""
    sizes = buffers.sizes
    width = 3 * sizes.layers * (sizes.nodes - 2)
    for row, state in zip(buffers.section(Section.SETS), states, strict=True):
        kept = state.plastic_curvature
        row[:width] = 0.0 if kept is None else np.ravel(kept)
    if sizes.derivatives & Derivatives.SENSITIVITIES:
        columns = buffers.section(Section.SET_SENSITIVITIES)
        columns[:] = 0.0
        for b, along in enumerate(directions):
            _write_columns(columns[b], sizes.columns, along.plastic_curvature)
    if sizes.derivatives & Derivatives.ADJOINT:
        buffers.section(Section.SET_ADJOINT)[:] = 0.0


class StartPlace(NamedTuple):
    """Views of the numbers from which the kernel's `start_history` makes a rod's history."""

    velocities: Float64[np.ndarray, "n 3"]
    positions: Float64[np.ndarray, "n 3"]
    angular_velocities: Float64[np.ndarray, "m 3"]
    orientations: Float64[np.ndarray, "m 4"]
    grips: list[tuple[Float64[np.ndarray, "2 3"], Float64[np.ndarray, "2 3"]]]
    """For each clamp, velocity and position of the outer node and of the end node, which repeat."""

    def write(self, state: RodState) -> None:
        """Write a state."""
        self.velocities[:], self.positions[:] = state.velocities, state.positions
        self.angular_velocities[:] = state.angular_velocities
        self.orientations[:] = state.orientations
        for outer, end in self.grips:
            outer[:] = end


def _action_place(buffers: LaunchBuffers[Sizes]) -> Float64[np.ndarray, "B K 2 6"]:
    sizes = buffers.sizes
    return buffers.section(Section.ACTIONS).reshape(sizes.batch, sizes.action_blocks, 2, 6)


def _start_places(buffers: LaunchBuffers[Sizes]) -> list[StartPlace]:
    n, nodes, (left, right) = buffers.sizes.nodes, buffers.sizes.rod_nodes, buffers.sizes.clamps
    new, old = HISTORY_SLOTS, HISTORY_SLOTS - 1
    places = []
    for positions, orientations in zip(
        buffers.section(Section.POSITIONS), buffers.section(Section.ORIENTATIONS), strict=True
    ):
        x = positions[3 * n * (old - 1) : 3 * n * new].reshape(2, n, 3)
        q = orientations[4 * (n - 1) * (old - 1) : 4 * (n - 1) * new].reshape(2, n - 1, 4)
        grips = [(x[:, 0], x[:, 1])] * left + [(x[:, -1], x[:, -2])] * right
        places.append(StartPlace(x[0, nodes], x[1, nodes], q[0, :, :3], q[1], grips))
    return places


def _write_derivative_inputs(
    buffers: LaunchBuffers[Sizes],
    request: DerivativeRequest,
    states: Sequence[RodState],
    h: float,
) -> None:
    if request.kinds & Derivatives.SENSITIVITIES:
        for b, (state, along) in enumerate(zip(states, request.directions or (), strict=False)):
            _write_directions(buffers, b, state, along, h)
    if request.kinds & Derivatives.ADJOINT:
        _write_adjoint_seed(buffers, request.d_cost_d_positions)


def _write_adjoint_seed(
    buffers: LaunchBuffers[Sizes], cost: Float64[np.ndarray, "B H n 3"] | None
) -> None:
    """Write the gradient of the cost in the positions, and clear the sums of the adjoint."""
    cost = np.asarray(cost, float)
    sizes = buffers.sizes
    nodes = sizes.nodes - sum(sizes.clamps)
    if cost.shape != (sizes.batch, sizes.horizon, nodes, 3):
        raise ValueError(
            f"d_cost_d_positions must be ({sizes.horizon} steps, {nodes} nodes, 3), got "
            f"shape {cost.shape[1:]}"
        )
    if not math.isfinite(np.vdot(cost, cost)):
        raise ValueError("d_cost_d_positions must be finite")
    sums, seed = buffers.once(_adjoint_places)
    sums[:] = 0.0
    seed[:] = cost


def _adjoint_places(
    buffers: LaunchBuffers[Sizes],
) -> tuple[Float64[np.ndarray, "B k"], Float64[np.ndarray, "B H n 3"]]:
    """Return views of the numbers that start from zero, and of the cost's gradient among them."""
    sizes, places = buffers.sizes, buffers.places
    sums = slice(places[Section.ADJOINT].start, places[Section.PARAMETERS_OUT].stop)
    seed = buffers.section(Section.COST_GRADIENT).reshape(-1, sizes.horizon, sizes.nodes, 3)
    return buffers.rods[:, sums], seed[:, :, sizes.rod_nodes]


def _write_directions(
    buffers: LaunchBuffers[Sizes], b: int, state: RodState, along: StateDirections, h: float
) -> None:
    """Write directions into the sensitivities of the initial state and of the time before it."""
    n, sizes = buffers.sizes.nodes, buffers.sizes
    groups = -(-sizes.state_directions // GROUP_COLUMNS)
    tail = np.zeros((GROUP_COLUMNS * groups, HISTORY_SLOTS, 2 * n, 3))
    new, old = tail[: sizes.state_directions, -1], tail[: sizes.state_directions, 0]
    new[:, ::2] = with_grips(along.positions, sizes.clamps)
    old[:, ::2] = with_grips(along.positions - h * along.velocities, sizes.clamps)
    # One step before the start an edge was at exp(-h omega) q.
    rotated_by = left_jacobian(h * state.angular_velocities, along.angular_velocities)
    back = poses.conjugate(state.orientations)
    new[:, 1:-1:2] = poses.rotate(back, along.rotations)
    old[:, 1:-1:2] = poses.rotate(back, along.rotations - h * rotated_by)
    tail[:, 1:-1] = tail[:, :1]
    rows = tail[:, :, :-1].reshape(groups, GROUP_COLUMNS, HISTORY_SLOTS, 2 * n - 1, 3)
    rows = rows.transpose(0, 3, 2, 4, 1).reshape(groups, 2 * n - 1, HISTORY_SLOTS, -1)
    columns = buffers.section(Section.SENSITIVITIES)[b].reshape(
        sizes.columns, 2 * n - 1, -1, COLUMNS_WIDTH
    )
    # The latest solve comes first.
    columns[-groups:, :, :HISTORY_SLOTS] = rows[:, :, ::-1]


def pack_constants(model: ImplicitRodModel) -> Constants:
    """Return the numbers of every launch that depend on the rod alone."""
    p, n, length = model.properties, model.node_count, model.edge_length
    scalars = np.zeros(len(Scalar))
    for scalar in Scalar:
        scalars[scalar] = getattr(p, scalar.name.lower(), 0.0)
    scalars[Scalar.EDGE_LENGTH] = length
    scalars[Scalar.GRAVITY_X : Scalar.GRAVITY_Z + 1] = model.gravity
    scalars[Scalar.CONTACT_STIFFNESS] = p.effective_contact_stiffness
    scalars[Scalar.CONTACT_REACH] = p.diameter / 2.0 + p.contact_margin
    scalars[Scalar.TOLERANCE] = model.tolerance
    # Solid cylinder: rho I is the linear density times r^2 / 4, and twice that about its axis.
    scalars[Scalar.BENDING_INERTIA] = p.linear_density * length * p.diameter**2 / 16.0
    scalars[Scalar.TWISTING_INERTIA] = 2.0 * scalars[Scalar.BENDING_INERTIA]
    left, _right = model.clamps
    masses = np.zeros(model.frame_count + 1)
    rod_masses = masses[left : left + n]
    rod_masses[:] = p.linear_density * length * p.density_at(n)
    rod_masses[[0, -1]] *= 0.5
    lengths, places = model.bend_lengths[:, None], model.bend_places
    bends = np.empty((len(places), 6))
    bends[:, :3] = [p.bending_stiffness, p.bending_stiffness, p.twisting_stiffness]
    bends[:, :3] *= p.profile_at(places)[:, None] / lengths
    bends[:, 3:] = p.rest_curvature_at(places) * lengths
    layers = p.layers
    doubles = np.concatenate([scalars, masses, bends.ravel(), layers.ravel()])
    return Constants(doubles, _model_header(model), len(layers))


def _model_header(model: ImplicitRodModel) -> Int32[np.ndarray, "c"]:
    """Return how the ends are held and how finely contact is sampled."""
    integers = np.zeros(len(Header), dtype=np.int32)
    edge, diameter = model.edge_length, model.properties.diameter
    left, right = model.clamps
    integers[Header.FIRST_EDGE] = left
    integers[Header.END_EDGE] = model.frame_count - right
    integers[Header.FIRST_FREE] = HELD_BLOCKS[model.left]
    integers[Header.END_FREE] = 2 * model.frame_count + 1 - HELD_BLOCKS[model.right]
    integers[Header.LEFT_END], integers[Header.RIGHT_END] = (
        ENDS.index(model.left),
        ENDS.index(model.right),
    )
    integers[Header.MAX_ITERATIONS] = MAX_ITERATIONS
    samples = math.ceil(2.0 * edge / diameter)
    integers[Header.CONTACT_SAMPLES] = min(MAX_EDGE_SAMPLES, max(1, samples))
    if model.self_contact:
        samples = math.ceil(edge / diameter)
        integers[Header.SELF_CONTACT_SAMPLES] = min(MAX_STRAND_SAMPLES, max(1, samples))
        # The tightest bend, a half circle of the rod's own radius, does not touch itself.
        half_circle = 0.5 * math.pi * (diameter + model.properties.contact_margin)
        integers[Header.SELF_CONTACT_GAP] = 1 + max(2, math.ceil(half_circle / edge))
    return integers[MODEL_HEADER]
