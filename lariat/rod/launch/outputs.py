"""Reads what a launch has left in its arrays."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.rod.launch import layout
from lariat.rod.launch.buffers import Sheet
from lariat.rod.so3 import left_jacobian
from lariat.rod.state import Gradient, Linearization, RodState, Rollout, StateGradient


def rolled(sheet: Sheet, b: int, length: float) -> Rollout:
    """The roll-out of one rod of the batch."""
    n, sizes = sheet.sizes.nodes, sheet.sizes
    every = sizes.steps // sizes.horizon
    positions = sheet.section(layout.AT_POSITIONS)[b].reshape(-1, n, 3)
    positions = positions[layout.NEW - 1 + every :: every]
    orientations = sheet.section(layout.AT_ORIENTATIONS)[b].reshape(-1, n - 1, 4)
    orientations = orientations[layout.NEW - 1 + every :: every]
    report = sheet.section(layout.AT_REPORT)[b].reshape(sizes.horizon, every, -1)
    positions, orientations = positions.copy(), orientations.copy()
    return Rollout(
        positions,
        orientations,
        RodState(
            positions[-1],
            orientations[-1],
            sheet.section(layout.AT_TARGETS)[b].reshape(n, 3).copy(),
            sheet.section(layout.AT_TENSIONS)[b].reshape(n - 1, 3).copy(),
        ),
        report[:, :, 0].sum(axis=1).astype(np.int64),
        np.all(report[:, :, 1] > 0.0, axis=1),
        length,
    )


def linearized(sheet: Sheet, b: int, length: float) -> Linearization:
    """The roll-out of one rod of the batch with its forward sensitivities."""
    n, sizes = sheet.sizes.nodes, sheet.sizes
    driven, blocks = 6 * sizes.driven, sizes.driven // 2
    steady = driven + 6 * -(-sizes.parameters // 6)
    out = sheet.section(layout.AT_SENSITIVITIES_OUT)[b].reshape(sizes.horizon, n, 3, -1)
    return Linearization(
        rolled(sheet, b, length),
        out[..., :driven].reshape(sizes.horizon, n, 3, blocks, 2, 6).copy(),
        out[..., driven : driven + sizes.parameters].copy(),
        out[..., steady : steady + sizes.directions].copy(),
    )


def slopes(
    sheet: Sheet, b: int, state: RodState, length: float, parameters: tuple[str, ...]
) -> Gradient:
    """The roll-out of one rod of the batch with what the adjoint found.

    Args:
        state: The start of that rod.
    """
    actions = sheet.section(layout.AT_ACTIONS_OUT)[b].reshape(sheet.sizes.blocks, 2, 6)
    values = sheet.section(layout.AT_PARAMETERS_OUT)[b].tolist()
    return Gradient(
        rolled(sheet, b, length),
        actions.copy(),
        _state_slope(sheet, b, state),
        dict(zip(parameters, values, strict=True)),
    )


def _state_slope(sheet: Sheet, b: int, state: RodState) -> StateGradient:
    n = sheet.sizes.nodes
    h = float(sheet.section(layout.AT_TIMES)[b, layout.DURATION])
    adjoint = sheet.section(layout.AT_ADJOINT)[b].reshape(-1, 3 * (2 * n - 1))[: layout.NEW]
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
