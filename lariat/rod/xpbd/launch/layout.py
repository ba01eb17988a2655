"""Where everything lies in the two arrays that the kernel works on; see `lariat.rod.launch.layout`.

Slot 0 of a history is the state that a roll-out begins with, slot t + 1 that after step t. The tape
holds what every correction of the constraints took in, for the adjoint.
"""

from __future__ import annotations

from dataclasses import dataclass

# Sizes, in the integer array.
NODES, STEPS, BLOCKS, OBSTACLES, ITERATIONS, SUBSTEPS, TAPED, STRIDE = range(8)
FIRST_NODE, END_NODE, FIRST_EDGE, END_EDGE, CONTACT_LIMIT, LEFT, RIGHT = range(8, 15)
# Offsets of a rod's sections from its start, in the integer array.
(
    AT_SCALARS,
    AT_DARBOUX,
    AT_ACTIONS,
    AT_POSITIONS,
    AT_ORIENTATIONS,
    AT_VELOCITIES,
    AT_ANGULAR_VELOCITIES,
    AT_MULTIPLIERS,
    AT_CONTACT_MULTIPLIERS,
    AT_CONTACT_COUNTS,
    AT_CONTACTS,
    AT_PREDICTED,
    AT_STRETCH_TAPE,
    AT_BEND_TAPE,
    AT_CONTACT_TAPE,
    AT_COST,
    AT_D_POSITIONS,
    AT_D_ORIENTATIONS,
    AT_D_VELOCITIES,
    AT_D_ANGULAR_VELOCITIES,
    AT_D_GRIPS,
    AT_D_NODES,
    AT_D_EDGES,
    AT_D_NORMALS,
    AT_D_MULTIPLIERS,
    AT_D_CONTACT_MULTIPLIERS,
    AT_D_ACTIONS,
    AT_D_PARAMETERS,
) = range(16, 44)
AT_OBSTACLES = 44
"""Absolute: obstacles are shared by the batch."""
INTEGERS = 48
"""Here the block of every step begins."""

# Scalars of a rod, in its section of that name.
EDGE_LENGTH, STEP, GRAVITY_X, GRAVITY_Y, GRAVITY_Z, RADIUS = range(6)
NODE_WEIGHT, EDGE_WEIGHT, LINEAR_DAMPING, ANGULAR_DAMPING, COMPLIANCE = range(6, 11)
CONTACT_COMPLIANCE = 11
SCALAR_COUNT = 12

STRETCH_WIDTH = 8
"""Quaternion (4), multiplier's change (3), factor of normalising."""
BEND_WIDTH = 13
"""Two quaternions (8), multiplier's change (3), two factors."""
CONTACT_WIDTH = 13
"""Node, obstacle's row, whether by its entry point, share of the way to that, the point (3), its
normal (3), where the node would have gone (3)."""
CONTACT_TAPE_WIDTH = 5
"""The node's position (3), multiplier's change, whether the multiplier met its bound."""
PREDICTED_WIDTH = 5
"""Quaternion (4) and norm before normalising."""
OBSTACLE_WIDTH = 17
CONTACTS_PER_NODE = 3

FREE, PINNED, CLAMPED = range(3)
MASS, INERTIA, LINEAR, ANGULAR, BENDING = range(5)
"""Places of the parameters' derivatives."""
PARAMETER_COUNT = 5


@dataclass(frozen=True)
class Sizes:
    """What one launch is about."""

    batch: int
    nodes: int
    steps: int
    """Horizon times substeps."""
    substeps: int
    blocks: int
    obstacles: int
    iterations: int
    taped: bool
    """Whether derivatives will be asked for."""

    @property
    def contact_limit(self) -> int:
        """Most contacts in one step."""
        return self.nodes * min(self.obstacles, CONTACTS_PER_NODE)


def sections(sizes: Sizes) -> tuple[dict[int, tuple[int, int]], int]:
    """Offset and length of each section of a rod, and the length of all together."""
    n, steps, contacts = sizes.nodes, sizes.steps, sizes.contact_limit
    sweeps = steps * sizes.iterations if sizes.taped else 1
    kept = steps if sizes.taped else 1
    back = 1 if sizes.taped else 0
    lengths = {
        AT_SCALARS: SCALAR_COUNT,
        AT_DARBOUX: 3 * (n - 2),
        AT_ACTIONS: 12 * sizes.blocks,
        AT_POSITIONS: 3 * n * (steps + 1),
        AT_ORIENTATIONS: 4 * (n - 1) * (steps + 1),
        AT_VELOCITIES: 3 * n * (steps + 1),
        AT_ANGULAR_VELOCITIES: 3 * (n - 1) * (steps + 1),
        AT_MULTIPLIERS: 3 * (n - 2) * kept,
        AT_CONTACT_MULTIPLIERS: contacts * kept,
        AT_CONTACT_COUNTS: kept,
        AT_CONTACTS: CONTACT_WIDTH * contacts * kept,
        AT_PREDICTED: PREDICTED_WIDTH * (n - 1) * kept,
        AT_STRETCH_TAPE: STRETCH_WIDTH * (n - 1) * sweeps,
        AT_BEND_TAPE: BEND_WIDTH * (n - 2) * sweeps,
        AT_CONTACT_TAPE: CONTACT_TAPE_WIDTH * contacts * sweeps,
        AT_COST: back * 3 * n * (steps // sizes.substeps),
        AT_D_POSITIONS: back * 3 * n,
        AT_D_ORIENTATIONS: back * 4 * (n - 1),
        AT_D_VELOCITIES: back * 3 * n,
        AT_D_ANGULAR_VELOCITIES: back * 3 * (n - 1),
        AT_D_GRIPS: back * 6,
        AT_D_NODES: back * 3 * n,
        AT_D_EDGES: back * 4 * (n - 1),
        AT_D_NORMALS: back * 3 * contacts,
        AT_D_MULTIPLIERS: back * 3 * (n - 2),
        AT_D_CONTACT_MULTIPLIERS: back * contacts,
        AT_D_ACTIONS: back * 12 * sizes.blocks,
        AT_D_PARAMETERS: back * PARAMETER_COUNT,
    }
    offsets = {}
    at = 0
    for name, length in lengths.items():
        offsets[name] = (at, length)
        at += length
    return offsets, at
