"""Fills the arrays of a launch with what one or several rods are about to do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64, Int64

from lariat.rod.checks import check_launch, check_state
from lariat.rod.launch.inputs import ENDS
from lariat.rod.state import RodState
from lariat.rod.xpbd.launch import layout
from lariat.rod.xpbd.launch.buffers import Sheet
from lariat.rod.xpbd.launch.layout import Sizes

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
) -> Sheet:
    """All but a cost; arguments as of `XpbdRod.rollouts`.

    Args:
        taped: Whether derivatives will be asked for.
    """
    n = rod.node_count
    actions = np.asarray(actions, float)
    block_of_step = check_launch(len(states), actions, dt, steps, block_of_step, substeps)
    rows = rod.launch.rows(obstacles)
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
    sheet = rod.launch.open(sizes, block_of_step)
    integers = sheet.integers
    integers[layout.FIRST_NODE] = HELD_NODES[rod.left]
    integers[layout.END_NODE] = n - HELD_NODES[rod.right]
    integers[layout.FIRST_EDGE] = rod.left == "clamped"
    integers[layout.END_EDGE] = n - 1 - (rod.right == "clamped")
    integers[layout.LEFT], integers[layout.RIGHT] = ENDS.index(rod.left), ENDS.index(rod.right)
    rods = sheet.doubles[: sheet.stride * len(states)].reshape(len(states), -1)
    rods[:, : len(rod.constants)] = rod.constants
    sheet.section(layout.AT_SCALARS)[:, layout.STEP] = dt / substeps
    sheet.section(layout.AT_ACTIONS)[:] = actions.reshape(len(states), -1)
    for b, state in enumerate(states):
        check_state(state, n)
        for section, value in (
            (layout.AT_POSITIONS, state.positions),
            (layout.AT_ORIENTATIONS, state.orientations),
            (layout.AT_VELOCITIES, state.velocities),
            (layout.AT_ANGULAR_VELOCITIES, state.angular_velocities),
        ):
            sheet.section(section)[b, : value.size] = value.ravel()
    if taped:
        rods[:, sheet.offsets[layout.AT_D_POSITIONS][0] :] = 0.0
    sheet.obstacles()[:] = rows
    return sheet


def constants(rod: XpbdRod) -> Float64[np.ndarray, "k"]:
    """Scalars but for the step, and rest shape, in the order of their sections."""
    p = rod.properties
    scalars = np.zeros(layout.SCALAR_COUNT)
    scalars[layout.EDGE_LENGTH] = rod.edge_length
    scalars[layout.GRAVITY_X : layout.GRAVITY_Z + 1] = rod.gravity
    scalars[layout.RADIUS] = p.diameter / 2.0
    scalars[layout.NODE_WEIGHT] = 1.0 / p.mass
    scalars[layout.EDGE_WEIGHT] = 1.0 / p.inertia
    scalars[layout.LINEAR_DAMPING] = p.linear_damping
    scalars[layout.ANGULAR_DAMPING] = p.angular_damping
    scalars[layout.COMPLIANCE] = p.bending_compliance
    scalars[layout.CONTACT_COMPLIANCE] = p.contact_compliance
    return np.concatenate([scalars, p.rest_darboux(rod.node_count).ravel()])
