"""Launch outputs: roll-out, sensitivities and gradients, read from the buffers of a launch."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.rod.launch.buffers import LaunchBuffers
from lariat.rod.launch.grip_edges import fold_grips
from lariat.rod.launch.layout import HISTORY_SLOTS, ReportRow, Section, TimeRow
from lariat.rod.launch.sizes import Sizes
from lariat.rod.results import Gradient, Linearization, Rollout, StateGradient
from lariat.rod.so3 import left_jacobian
from lariat.rod.state import RodState


def read_rollout(buffers: LaunchBuffers[Sizes], b: int, length: float) -> Rollout:
    """Return the roll-out of rod b of the batch.

    Args:
        buffers: Buffers after the launch.
        b: Index in the batch.
        length: Rest length of the rod [m].
    """
    n, sizes = buffers.sizes.nodes, buffers.sizes
    solves = sizes.steps // sizes.horizon
    positions = buffers.section(Section.POSITIONS)[b].reshape(-1, n, 3)
    positions = positions[HISTORY_SLOTS - 1 + solves :: solves, sizes.rod_nodes]
    orientations = buffers.section(Section.ORIENTATIONS)[b].reshape(-1, n - 1, 4)
    orientations = orientations[HISTORY_SLOTS - 1 + solves :: solves]
    report = buffers.section(Section.REPORTS)[b].reshape(sizes.horizon, solves, -1)
    positions, orientations = positions.copy(), orientations.copy()
    return Rollout(
        positions,
        orientations,
        RodState(
            positions[-1],
            orientations[-1],
            buffers.section(Section.TARGET_POSITIONS)[b].reshape(n, 3)[sizes.rod_nodes].copy(),
            buffers.section(Section.TENSIONS)[b].reshape(n - 1, 3).copy(),
        ),
        report[:, :, ReportRow.ITERATIONS].sum(axis=1).astype(np.int64),
        np.all(report[:, :, ReportRow.CONVERGED] > 0.0, axis=1),
        length,
    )


def read_linearization(buffers: LaunchBuffers[Sizes], b: int, length: float) -> Linearization:
    """Return the roll-out of rod b of the batch with its forward sensitivities."""
    n, sizes = buffers.sizes.nodes, buffers.sizes
    driven, blocks = 6 * sizes.action_groups, sizes.action_groups // 2
    directions = driven + 6 * -(-sizes.parameters // 6)
    out = buffers.section(Section.SENSITIVITIES_OUT)[b].reshape(sizes.horizon, n, 3, -1)
    out = out[:, sizes.rod_nodes]
    n -= sum(sizes.clamps)
    return Linearization(
        read_rollout(buffers, b, length),
        out[..., :driven].reshape(sizes.horizon, n, 3, blocks, 2, 6).copy(),
        out[..., driven : driven + sizes.parameters].copy(),
        out[..., directions : directions + sizes.state_directions].copy(),
    )


def read_gradient(
    buffers: LaunchBuffers[Sizes],
    b: int,
    state: RodState,
    length: float,
    parameters: tuple[str, ...],
) -> Gradient:
    """Return the roll-out of rod b of the batch with the adjoint's gradient.

    Args:
        buffers: Buffers after the launch.
        b: Index in the batch.
        state: Initial state of that rod.
        length: Rest length of the rod [m].
        parameters: Names of the parameters, as requested.
    """
    actions = buffers.section(Section.ACTIONS_OUT)[b].reshape(buffers.sizes.action_blocks, 2, 6)
    values = buffers.section(Section.PARAMETERS_OUT)[b].tolist()
    return Gradient(
        read_rollout(buffers, b, length),
        actions.copy(),
        _state_gradient(buffers, b, state),
        dict(zip(parameters, values, strict=True)),
    )


def _state_gradient(buffers: LaunchBuffers[Sizes], b: int, state: RodState) -> StateGradient:
    n = buffers.sizes.nodes
    h = float(buffers.section(Section.TIMES)[b, TimeRow.DURATION])
    adjoint = buffers.section(Section.ADJOINT)[b].reshape(-1, 3 * (2 * n - 1))[:HISTORY_SLOTS]
    older, new = adjoint[:-1].sum(0), adjoint[-1]
    both = np.zeros((2, 6 * n))
    both[0, :-3], both[1, :-3] = older + new, older
    both = both.reshape(2, n, 2, 3)
    # One step before the start an edge was at exp(-h omega) q, which rotates with q, against omega.
    rotations, back = poses.rotate(state.orientations, both[:, :-1, 1])
    moved, before = (fold_grips(part, buffers.sizes.clamps) for part in both[:, :, 0])
    return StateGradient(
        moved,
        rotations,
        -h * before,
        -h * left_jacobian(-h * state.angular_velocities, back),
    )
