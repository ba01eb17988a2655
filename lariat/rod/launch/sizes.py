"""Sizes of a launch, and the sections that follow from them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.layout import (
    COLUMNS_STRIDE,
    COLUMNS_WIDTH,
    EFFECTIVE_BEND_WIDTH,
    FRICTION_CONTACT_WIDTH,
    FRICTION_HEAD,
    FROZEN_FRICTION_WIDTH,
    GROUP_COLUMNS,
    HESSIAN_WIDTH,
    HISTORY_SLOTS,
    LANE_STRIDE,
    LANE_TERMS,
    LAYER_WIDTH,
    MATRIX_WIDTH,
    REPORT_WIDTH,
    SELF_CONTACT_HEAD,
    SELF_CONTACT_WIDTH,
    TIME_WIDTH,
    Scalar,
    Section,
)

MATRIX_SECTIONS = frozenset(
    {
        Section.HESSIAN,
        Section.TRANSPOSED_HESSIAN,
        Section.INERTIA_COUPLINGS,
    }
)
"""Sections that the kernel reads as matrices."""


class Sizes(NamedTuple):
    """Sizes and kind of one launch."""

    batch: int
    nodes: int
    """Nodes of the chain, with one more for each clamp than the rod has."""
    steps: int
    """Implicit solves: horizon times substeps times stages of the scheme."""
    horizon: int
    action_blocks: int
    obstacles: int
    parameters: int
    state_directions: int
    action_groups: int
    """Groups of sensitivities to actions."""
    derivatives: Derivatives
    history: int
    """Number of earlier solves that enter one."""
    self_contacts: int
    """Capacity for contacts of the rod with itself."""
    clamps: tuple[int, int]
    """Number of clamps at the left and at the right end."""
    friction_pairs: int = 0
    """Pairs of a sample of an edge and an obstacle that have a slip."""

    layers: int = 0
    """Layers of each bend that yield."""

    @property
    def rod_nodes(self) -> slice:
        """Nodes of the chain that are those of the rod; grip edges add the others."""
        return slice(self.clamps[0], self.nodes - self.clamps[1])

    @property
    def parameter_groups(self) -> int:
        """Groups of columns of the parameters."""
        return -(-self.parameters // GROUP_COLUMNS)

    @property
    def columns(self) -> int:
        """Groups of columns of the forward sensitivities."""
        steady = self.action_groups + self.parameter_groups
        return steady + -(-self.state_directions // GROUP_COLUMNS)


def sections(sizes: Sizes) -> tuple[dict[int, slice], int]:
    """Return the place of each section in the doubles of a rod, and their number."""
    n, steps = sizes.nodes, sizes.steps
    unknowns = 2 * n - 1
    stored = steps if sizes.derivatives & Derivatives.ADJOINT else 1
    forward = 1 if sizes.derivatives & Derivatives.SENSITIVITIES else 0
    backward = 1 if sizes.derivatives & Derivatives.ADJOINT else 0
    pairs, sets = sizes.friction_pairs, sizes.layers * (n - 2)
    hessian = HESSIAN_WIDTH * unknowns * stored
    places, count = consecutive(
        {
            Section.SCALARS: len(Scalar),
            Section.MASSES: n,
            Section.BENDS: 6 * (n - 2),
            Section.LAYERS: LAYER_WIDTH * sizes.layers,
            Section.TIMES: TIME_WIDTH * steps,
            Section.ACTIONS: 12 * sizes.action_blocks,
            Section.POSITIONS: 3 * n * (steps + HISTORY_SLOTS),
            Section.ORIENTATIONS: 4 * (n - 1) * (steps + HISTORY_SLOTS),
            Section.TARGET_POSITIONS: 3 * n * stored,
            Section.TARGET_ORIENTATIONS: 4 * (n - 1) * stored,
            Section.TARGET_DERIVATIVES: 3 * (n - 1),
            Section.TENSIONS: 3 * (n - 1),
            Section.ACCEPTED_POSITIONS: 3 * n,
            Section.ACCEPTED_ORIENTATIONS: 4 * (n - 1),
            Section.HESSIAN: hessian,
            Section.TRANSPOSED_HESSIAN: hessian if pairs else 0,
            Section.GRADIENT: 3 * unknowns,
            Section.NEWTON_STEP: 3 * unknowns,
            Section.INERTIA_COUPLINGS: 9 * HISTORY_SLOTS * (n - 1),
            Section.EFFECTIVE_BENDS: EFFECTIVE_BEND_WIDTH * (n - 2) * stored,
            Section.BEND_JACOBIANS: 27 * (n - 2),
            Section.LANES: LANE_STRIDE * LANE_TERMS,
            Section.SELF_CONTACTS: SELF_CONTACT_HEAD + SELF_CONTACT_WIDTH * sizes.self_contacts,
            Section.SELF_CONTACT_COLUMNS: 3 * unknowns * sizes.self_contacts,
            Section.SELF_CONTACT_MATRIX: (sizes.self_contacts + 1) * sizes.self_contacts,
            Section.SELF_CONTACT_VECTORS: 9 * unknowns if sizes.self_contacts else 0,
            Section.REPORTS: REPORT_WIDTH * steps,
            Section.SENSITIVITIES: forward * COLUMNS_STRIDE * unknowns * sizes.columns,
            Section.SENSITIVITIES_OUT: forward * sizes.horizon * n * COLUMNS_WIDTH * sizes.columns,
            Section.PARAMETER_DERIVATIVES: COLUMNS_WIDTH * unknowns * sizes.parameter_groups,
            Section.ADJOINT: backward * 3 * unknowns * (steps + HISTORY_SLOTS),
            Section.COST_GRADIENT: backward * 3 * n * sizes.horizon,
            Section.ACTIONS_OUT: backward * 12 * sizes.action_blocks,
            Section.PARAMETERS_OUT: backward * sizes.parameters,
            Section.SLIPS: 3 * pairs * ((steps if backward else 1) + 1),
            Section.FROZEN_FRICTION: FROZEN_FRICTION_WIDTH * pairs,
            Section.FRICTION_CONTACTS: (
                FRICTION_HEAD + FRICTION_CONTACT_WIDTH * pairs if pairs else 0
            ),
            Section.SLIP_SENSITIVITIES: forward * COLUMNS_WIDTH * pairs * sizes.columns,
            Section.SLIP_STAMPS: forward * pairs,
            Section.SLIP_ADJOINT: backward * 3 * pairs,
            Section.SETS: 3 * sets * ((steps if backward else 1) + 1),
            Section.SET_SENSITIVITIES: forward * COLUMNS_WIDTH * sets * sizes.columns,
            Section.SET_ADJOINT: backward * 3 * sets,
        },
        MATRIX_SECTIONS,
    )
    if not pairs:
        places[Section.TRANSPOSED_HESSIAN] = places[Section.HESSIAN]
    return places, count


def consecutive(
    lengths: Mapping[int, int], matrices: Collection[int] = ()
) -> tuple[dict[int, slice], int]:
    """Return the places of sections that follow each other, and the numbers that they take.

    Args:
        lengths: Length of each section.
        matrices: Sections that start at a multiple of `MATRIX_WIDTH`; with any, the numbers that
            all sections take are a multiple of it as well.
    """
    places = {}
    stop = 0
    for section, length in lengths.items():
        start = _next_matrix(stop) if section in matrices else stop
        stop = start + length
        places[section] = slice(start, stop)
    return places, _next_matrix(stop) if matrices else stop


def _next_matrix(place: int) -> int:
    return -(-place // MATRIX_WIDTH) * MATRIX_WIDTH
