"""Reads what a launch has left in its arrays."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.rod.launch.buffers import LaunchBuffers
from lariat.rod.launch.layout import HISTORY_SLOTS, ReportRow, Section, TimeRow
from lariat.rod.launch.sizes import Sizes
from lariat.rod.so3 import left_jacobian
from lariat.rod.state import Gradient, Linearization, RodState, Rollout, StateGradient


def rolled(buffers: LaunchBuffers[Sizes], b: int, length: float) -> Rollout:
    """The roll-out of one rod of the batch."""
    n, sizes = buffers.sizes.nodes, buffers.sizes
    every = sizes.steps // sizes.horizon
    positions = buffers.section(Section.POSITIONS)[b].reshape(-1, n, 3)
    positions = positions[HISTORY_SLOTS - 1 + every :: every]
    orientations = buffers.section(Section.ORIENTATIONS)[b].reshape(-1, n - 1, 4)
    orientations = orientations[HISTORY_SLOTS - 1 + every :: every]
    report = buffers.section(Section.REPORTS)[b].reshape(sizes.horizon, every, -1)
    positions, orientations = positions.copy(), orientations.copy()
    return Rollout(
        positions,
        orientations,
        RodState(
            positions[-1],
            orientations[-1],
            buffers.section(Section.TARGET_POSITIONS)[b].reshape(n, 3).copy(),
            buffers.section(Section.TENSIONS)[b].reshape(n - 1, 3).copy(),
        ),
        report[:, :, ReportRow.ITERATIONS].sum(axis=1).astype(np.int64),
        np.all(report[:, :, ReportRow.CONVERGED] > 0.0, axis=1),
        length,
    )


def linearized(buffers: LaunchBuffers[Sizes], b: int, length: float) -> Linearization:
    """The roll-out of one rod of the batch with its forward sensitivities."""
    n, sizes = buffers.sizes.nodes, buffers.sizes
    driven, blocks = 6 * sizes.action_groups, sizes.action_groups // 2
    steady = driven + 6 * -(-sizes.parameters // 6)
    out = buffers.section(Section.SENSITIVITIES_OUT)[b].reshape(sizes.horizon, n, 3, -1)
    return Linearization(
        rolled(buffers, b, length),
        out[..., :driven].reshape(sizes.horizon, n, 3, blocks, 2, 6).copy(),
        out[..., driven : driven + sizes.parameters].copy(),
        out[..., steady : steady + sizes.state_directions].copy(),
    )


def slopes(
    buffers: LaunchBuffers[Sizes],
    b: int,
    state: RodState,
    length: float,
    parameters: tuple[str, ...],
) -> Gradient:
    """The roll-out of one rod of the batch with what the adjoint found.

    Args:
        state: The start of that rod.
    """
    actions = buffers.section(Section.ACTIONS_OUT)[b].reshape(buffers.sizes.action_blocks, 2, 6)
    values = buffers.section(Section.PARAMETERS_OUT)[b].tolist()
    return Gradient(
        rolled(buffers, b, length),
        actions.copy(),
        _state_slope(buffers, b, state),
        dict(zip(parameters, values, strict=True)),
    )


def _state_slope(buffers: LaunchBuffers[Sizes], b: int, state: RodState) -> StateGradient:
    n = buffers.sizes.nodes
    h = float(buffers.section(Section.TIMES)[b, TimeRow.DURATION])
    adjoint = buffers.section(Section.ADJOINT)[b].reshape(-1, 3 * (2 * n - 1))[:HISTORY_SLOTS]
    older, new = adjoint[:-1].sum(0), adjoint[-1]
    both = np.zeros((2, 6 * n))
    both[0, :-3], both[1, :-3] = older + new, older
    both = both.reshape(2, n, 2, 3)
    # Before the start an edge was at exp(-h omega) q: it turns along, and against omega.
    turns, pull = poses.rotate(state.orientations, both[:, :-1, 1])
    return StateGradient(
        both[0, :, 0].copy(),
        turns,
        -h * both[1, :, 0],
        -h * left_jacobian(-h * state.angular_velocities, pull),
    )
