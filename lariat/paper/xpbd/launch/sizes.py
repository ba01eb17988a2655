"""Sizes of a launch, and the sections that follow from them."""

from __future__ import annotations

from dataclasses import dataclass

from lariat.paper.xpbd.launch.layout import (
    BEND_TAPE_WIDTH,
    CONTACT_TAPE_WIDTH,
    CONTACT_WIDTH,
    CONTACTS_PER_NODE,
    PREDICTED_WIDTH,
    STRETCH_TAPE_WIDTH,
    Parameter,
    Scalar,
    Section,
)
from lariat.rod.launch.sizes import consecutive


@dataclass(frozen=True)
class Sizes:
    """Sizes and kind of one launch."""

    batch: int
    nodes: int
    """Nodes of the chain, with one more for each clamp than the rod has."""
    steps: int
    """Horizon times substeps."""
    substeps: int
    action_blocks: int
    obstacles: int
    iterations: int
    """J, sweeps over the constraints in each step."""
    taped: bool
    """Whether the launch writes the tape of the adjoint."""
    clamps: tuple[int, int]
    """Number of clamps at the left and at the right end."""

    @property
    def rod_nodes(self) -> slice:
        """Nodes of the chain that are those of the rod; grip edges add the others."""
        return slice(self.clamps[0], self.nodes - self.clamps[1])

    @property
    def contact_limit(self) -> int:
        """Capacity for contacts in each step."""
        return self.nodes * min(self.obstacles, CONTACTS_PER_NODE)


def sections(sizes: Sizes) -> tuple[dict[int, slice], int]:
    """Return the place of each section in the doubles of a rod, and their number."""
    n, steps, contacts = sizes.nodes, sizes.steps, sizes.contact_limit
    sweeps = steps * sizes.iterations if sizes.taped else 1
    stored = steps if sizes.taped else 1
    backward = 1 if sizes.taped else 0
    return consecutive(
        {
            Section.SCALARS: len(Scalar),
            Section.REST_DARBOUX: 3 * (n - 2),
            Section.ACTIONS: 12 * sizes.action_blocks,
            Section.POSITIONS: 3 * n * (steps + 1),
            Section.ORIENTATIONS: 4 * (n - 1) * (steps + 1),
            Section.VELOCITIES: 3 * n * (steps + 1),
            Section.ANGULAR_VELOCITIES: 3 * (n - 1) * (steps + 1),
            Section.MULTIPLIERS: 3 * (n - 2) * stored,
            Section.CONTACT_MULTIPLIERS: contacts * stored,
            Section.CONTACT_COUNTS: stored,
            Section.CONTACTS: CONTACT_WIDTH * contacts * stored,
            Section.PREDICTED_ORIENTATIONS: PREDICTED_WIDTH * (n - 1) * stored,
            Section.STRETCH_TAPE: STRETCH_TAPE_WIDTH * (n - 1) * sweeps,
            Section.BEND_TAPE: BEND_TAPE_WIDTH * (n - 2) * sweeps,
            Section.CONTACT_TAPE: CONTACT_TAPE_WIDTH * contacts * sweeps,
            Section.COST_GRADIENT: backward * 3 * n * (steps // sizes.substeps),
            Section.D_POSITIONS: backward * 3 * n,
            Section.D_ORIENTATIONS: backward * 4 * (n - 1),
            Section.D_VELOCITIES: backward * 3 * n,
            Section.D_ANGULAR_VELOCITIES: backward * 3 * (n - 1),
            Section.D_GRIPS: backward * 6,
            Section.D_NODES: backward * 3 * n,
            Section.D_EDGES: backward * 4 * (n - 1),
            Section.D_NORMALS: backward * 3 * contacts,
            Section.D_MULTIPLIERS: backward * 3 * (n - 2),
            Section.D_CONTACT_MULTIPLIERS: backward * contacts,
            Section.D_ACTIONS: backward * 12 * sizes.action_blocks,
            Section.D_PARAMETERS: backward * len(Parameter),
        }
    )
