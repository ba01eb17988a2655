"""Launch outputs: roll-out, sensitivities and gradients, read from the buffers of a launch."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.rod.friction import ContactSlips
from lariat.rod.launch.buffers import LaunchBuffers
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.grip_edges import fold_grips
from lariat.rod.launch.layout import GROUP_COLUMNS, HISTORY_SLOTS, ReportRow, Section, TimeRow
from lariat.rod.launch.sizes import Sizes
from lariat.rod.results import Gradient, Linearization, Rollout, StateGradient
from lariat.rod.so3 import left_jacobian
from lariat.rod.state import RodState


def read_rollouts(
    buffers: LaunchBuffers[Sizes],
    length: float,
    bodies: Float64[np.ndarray, "m 13"] | None = None,
) -> list[Rollout]:
    """Return the roll-out of every rod of the batch.

    Args:
        buffers: Buffers after the launch.
        length: Rest length of the rods [m].
        bodies: Obstacles of the launch.
    """
    *motion, counts, converged = buffers.once(_results)
    # Arrays are indexed: to iterate over them takes several times as long.
    x, q, v, omega = (view.copy() for view in motion)
    if counts.shape[2] == 1:
        iterations, done = counts[:, :, 0].astype(np.int64), converged[:, :, 0].astype(bool)
    else:
        iterations = counts.sum(axis=2).astype(np.int64)
        done = converged.astype(bool).all(axis=2)
    return [
        Rollout(
            x[b],
            q[b],
            RodState(
                x[b, -1], q[b, -1], v[b], omega[b], _slips(buffers, b, bodies), _sets(buffers, b)
            ),
            iterations[b],
            done[b],
            length,
        )
        for b in range(buffers.sizes.batch)
    ]


def _slips(
    buffers: LaunchBuffers[Sizes], b: int, bodies: Float64[np.ndarray, "m 13"] | None
) -> ContactSlips | None:
    """Return the slips of a rod after the last solve; None without friction."""
    sizes = buffers.sizes
    if bodies is None or not sizes.friction_pairs:
        return None
    bodies = np.array(bodies, float)
    stored = sizes.steps if sizes.derivatives & Derivatives.ADJOINT else sizes.steps % 2
    width = 3 * sizes.friction_pairs
    row = buffers.section(Section.SLIPS)[b, width * stored : width * (stored + 1)]
    return ContactSlips(row.reshape(*_slip_shape(sizes)).copy(), bodies)


def _sets(buffers: LaunchBuffers[Sizes], b: int) -> Float64[np.ndarray, "m-1 l 3"] | None:
    """Return what layers of a rod's bends keep after the last solve; None without layers."""
    sizes = buffers.sizes
    if not sizes.layers:
        return None
    sets = buffers.section(Section.SETS)[b].reshape(-1, sizes.nodes - 2, sizes.layers, 3)
    return sets[sizes.steps if sizes.derivatives & Derivatives.ADJOINT else sizes.steps % 2].copy()


def _slip_shape(sizes: Sizes) -> tuple[int, int, int, int]:
    """Return the numbers of obstacles, edges, samples of an edge, and of components."""
    edges = sizes.nodes - sum(sizes.clamps) - 1
    return sizes.obstacles, edges, sizes.friction_pairs // (sizes.obstacles * edges), 3


def _results(buffers: LaunchBuffers[Sizes]) -> tuple[Float64[np.ndarray, "B ..."], ...]:
    """Return positions and orientations of every step, the last velocities and angular velocities,
    and iterations and convergence of every solve, as views."""
    n, sizes = buffers.sizes.nodes, buffers.sizes
    batch, nodes = sizes.batch, sizes.rod_nodes
    solves = sizes.steps // sizes.horizon
    ends = slice(HISTORY_SLOTS - 1 + solves, None, solves)
    report = buffers.section(Section.REPORTS).reshape(batch, sizes.horizon, solves, -1)
    return (
        buffers.section(Section.POSITIONS).reshape(batch, -1, n, 3)[:, ends, nodes],
        buffers.section(Section.ORIENTATIONS).reshape(batch, -1, n - 1, 4)[:, ends],
        buffers.section(Section.TARGET_POSITIONS).reshape(batch, -1, n, 3)[:, 0, nodes],
        buffers.section(Section.TENSIONS).reshape(batch, n - 1, 3),
        report[..., ReportRow.ITERATIONS],
        report[..., ReportRow.CONVERGED],
    )


def read_linearizations(
    buffers: LaunchBuffers[Sizes],
    length: float,
    bodies: Float64[np.ndarray, "m 13"] | None = None,
) -> list[Linearization]:
    """Return the roll-out of every rod of the batch with its forward sensitivities."""
    sizes = buffers.sizes
    driven = GROUP_COLUMNS * sizes.action_groups
    directions = driven + GROUP_COLUMNS * sizes.parameter_groups
    linearizations = []
    for b, rollout in enumerate(read_rollouts(buffers, length, bodies)):
        out = buffers.section(Section.SENSITIVITIES_OUT)[b]
        out = out.reshape(sizes.horizon, sizes.nodes, 3, -1)[:, sizes.rod_nodes]
        actions = out[..., :driven].reshape(*out.shape[:3], sizes.action_groups, 2, 6).copy()
        parameters = out[..., driven : driven + sizes.parameters].copy()
        along = out[..., directions : directions + sizes.state_directions].copy()
        linearizations.append(Linearization(rollout, actions, parameters, along))
    return linearizations


def read_gradients(
    buffers: LaunchBuffers[Sizes],
    states: Sequence[RodState],
    length: float,
    parameters: tuple[str, ...],
    bodies: Float64[np.ndarray, "m 13"] | None = None,
) -> list[Gradient]:
    """Return the roll-out of every rod of the batch with the adjoint's gradient.

    Args:
        buffers: Buffers after the launch.
        states: Initial state of each rod.
        length: Rest length of the rods [m].
        parameters: Names of the parameters, as requested.
        bodies: Obstacles of the launch.
    """
    sizes = buffers.sizes
    actions = buffers.section(Section.ACTIONS_OUT).reshape(-1, sizes.action_blocks, 2, 6).copy()
    values = buffers.section(Section.PARAMETERS_OUT).tolist()
    adjoints = buffers.section(Section.ADJOINT)
    adjoints = adjoints[:, : 3 * (2 * sizes.nodes - 1) * HISTORY_SLOTS].copy()
    h = float(buffers.section(Section.TIMES)[0, TimeRow.DURATION])
    return [
        Gradient(
            rollout,
            actions[b],
            dict(zip(parameters, values[b], strict=True)),
            partial(
                _state_gradient, adjoints[b], states[b], sizes, h, *_kept_gradients(buffers, b)
            ),
        )
        for b, rollout in enumerate(read_rollouts(buffers, length, bodies))
    ]


def _kept_gradients(
    buffers: LaunchBuffers[Sizes], b: int
) -> tuple[Float64[np.ndarray, "m e s 3"] | None, Float64[np.ndarray, "m-1 l 3"] | None]:
    """Return the gradients in slips, and in what layers of the bends keep."""
    sizes = buffers.sizes
    slips, sets = (buffers.section(s)[b] for s in (Section.SLIP_ADJOINT, Section.SET_ADJOINT))
    return (
        slips.reshape(*_slip_shape(sizes)).copy() if sizes.friction_pairs else None,
        sets.reshape(-1, sizes.layers, 3).copy() if sizes.layers else None,
    )


def _state_gradient(
    adjoint: Float64[np.ndarray, "k"],
    state: RodState,
    sizes: Sizes,
    h: float,
    slips: Float64[np.ndarray, "m e s 3"] | None,
    sets: Float64[np.ndarray, "m-1 l 3"] | None,
) -> StateGradient:
    n = sizes.nodes
    adjoint = adjoint.reshape(HISTORY_SLOTS, -1)
    older, new = adjoint[:-1].sum(0), adjoint[-1]
    both = np.zeros((2, 6 * n))
    both[0, :-3], both[1, :-3] = older + new, older
    both = both.reshape(2, n, 2, 3)
    # One step before the start an edge was at exp(-h omega) q, which rotates with q, against omega.
    rotations, back = poses.rotate(state.orientations, both[:, :-1, 1])
    moved, before = (fold_grips(part, sizes.clamps) for part in both[:, :, 0])
    return StateGradient(
        moved,
        rotations,
        -h * before,
        -h * left_jacobian(-h * state.angular_velocities, back),
        slips,
        sets,
    )
