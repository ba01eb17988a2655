"""Where everything lies in the two arrays that the kernel works on.

One launch takes an integer array (sizes, offsets, indices) and one array of doubles, in which
each rod of a batch owns a stretch of `stride` numbers. Launches cost by the argument, and numpy
views into the doubles make inputs and outputs free of copies.

Unknowns come in blocks of three: block 2 i is the position of node i, block 2 i + 1 the rotation
of edge i, as a tangent vector in the edge's own frame. The Hessian couples a block with the next
two, so that a block row is three 3x3 matrices: diagonal, H(j+1, j) and H(j+2, j).
"""

from __future__ import annotations

from dataclasses import dataclass

# Sizes, in the integer array.
BATCH, NODES, STEPS, FIRST_FREE, END_FREE, BLOCKS, OBSTACLES, PARAMETERS = range(8)
WANT, MAX_ITERATIONS, SAMPLES, SUBSTEPS, LEFT, RIGHT, STRIDE, HORIZON = range(8, 16)
# Offsets of a rod's sections from its start, in the integer array.
(
    AT_SCALARS,
    AT_MASSES,
    AT_BENDS,
    AT_TIMES,
    AT_ACTIONS,
    AT_POSITIONS,
    AT_ORIENTATIONS,
    AT_TARGETS,
    AT_TARGET_ORIENTATIONS,
    AT_TARGET_SLOPES,
    AT_TENSIONS,
    AT_ACCEPTED,
    AT_ACCEPTED_ORIENTATIONS,
    AT_HESSIAN,
    AT_GRADIENT,
    AT_STEP,
    AT_INERTIA_COUPLINGS,
    AT_EFFECTIVE_BENDS,
    AT_BEND_JACOBIANS,
    AT_REPORT,
    AT_SENSITIVITIES,
    AT_SENSITIVITIES_OUT,
    AT_PARAMETER_FORCES,
    AT_ADJOINT,
    AT_COST,
    AT_ACTIONS_OUT,
    AT_PARAMETERS_OUT,
) = range(16, 43)
AT_OBSTACLES = 43
"""Absolute: obstacles are shared by the batch."""
DIRECTIONS = 44
"""Count of directions of the initial state that sensitivities are carried along."""
DRIVEN = 45
"""Count of groups of six sensitivities to actions: two a block, or none at all."""
HISTORY = 46
"""How many of the solves before enter one: at most NEW."""
MOST_TOUCHES = 47
"""Places for touches of the rod with itself; none where that is not looked for."""
AT_TOUCHES, AT_TOUCH_COLUMNS, AT_TOUCH_MATRIX, AT_TOUCH_VECTORS = range(48, 52)
TOUCH_SAMPLES, TOUCH_GAP = range(52, 54)
"""Points of an edge that may touch, and how many edges further on others may be touched."""
INTEGERS = 54
"""Here the block of every step begins, followed by code, knot and knot count of each parameter."""
PARAMETER_WIDTH = 3

# Scalars of a rod, in its section of that name.
STRETCH, DAMPING, EDGE_LENGTH, GRAVITY_X, GRAVITY_Y, GRAVITY_Z = range(6)
CONTACT_STIFFNESS, CONTACT_REACH, CONTACT_MARGIN, TOLERANCE = range(6, 10)
BENDING, TWISTING, DENSITY, INERTIA_BEND, INERTIA_TWIST, INTERNAL_DAMPING = range(10, 16)
SCALAR_COUNT = 16

NEW = 4
"""Slot of positions and orientations that the first solve fills; the start is in the one before."""

# Of a solve, in its section of times.
DURATION, CARRIES, GRIP_BACK, GRIP_DURATION = range(4)
"""Grips are where they were `GRIP_BACK` solves ago, moved for `GRIP_DURATION`."""
BASE, MOMENTUM = 4, 8
"""Shares of the last four solves in the point from which velocity counts, and in displacement."""
TIME_WIDTH = 12

EFFECTIVE_WIDTH = 9
"""Stiffness (3) and rest (3) with internal damping, and the turn that damping counts from (3)."""
HESSIAN_WIDTH = 27
TOUCH_HEAD = 2
"""Before the touches: how many there are, and how many found no place."""
TOUCH_WIDTH = 14
"""Of a touch: both edges, the places along them, the normal (3), compliance [m/N], direction (3)
and one over the length of the other edge (zero at its ends), distance [m], force [N]."""
REPORT_WIDTH = 4
"""Of a step: iterations, converged, last step [m], definite (the Hessian's pivots positive)."""
OBSTACLE_WIDTH = 17
"""Shape index, position (3), rotation matrix (9), sizes (3), bounding radius."""

WANT_SENSITIVITIES = 1
WANT_ADJOINT = 2

FREE, PINNED, CLAMPED = range(3)

(
    EDGES,
    BENDS,
    CONTACTS,
    TOUCHES,
    FACTOR,
    SOLVE,
    COUPLE,
    ACCEPT,
    APPLY,
    TARGETS,
    PREDICT,
    GRIPS,
    INERTIA,
    PARAMETER_FORCES,
    GRIP_SENSITIVITIES,
    SENSITIVITIES,
    TOUCH_COUPLE,
    SOLVE_EXACTLY,
    SOLVE_AGAIN,
    WRITE,
    TOUCH_FOLD,
    GRIP_ADJOINT,
    ADJOINT,
    SOLVED,
    DONE,
) = range(25)
"""Tasks of the compiled parts."""

(
    BENDING_PARAMETER,
    TWISTING_PARAMETER,
    STRETCH_PARAMETER,
    DAMPING_PARAMETER,
    INTERNAL_DAMPING_PARAMETER,
    DENSITY_PARAMETER,
    LENGTH_PARAMETER,
    PROFILE_PARAMETER,
    CURVATURE_PARAMETER,
) = range(9)
DENSITY_PROFILE_PARAMETER = 11
"""Codes of parameters; the last is followed by the other two components of rest curvature."""


@dataclass(frozen=True)
class Sizes:
    """What one launch is about."""

    batch: int
    nodes: int
    steps: int
    """Implicit solves: horizon times substeps times stages."""
    horizon: int
    blocks: int
    """Blocks of actions."""
    obstacles: int
    parameters: int
    directions: int
    driven: int
    """Groups of six sensitivities to actions."""
    want: int
    history: int
    """How many of the solves before enter one."""
    touches: int
    """Places for touches of the rod with itself."""

    @property
    def columns(self) -> int:
        """Groups of six columns of the forward sensitivities."""
        return self.driven + -(-self.parameters // 6) + -(-self.directions // 6)


def sections(sizes: Sizes) -> tuple[dict[int, tuple[int, int]], int]:
    """Offset and length of each section of a rod, and the length of all together."""
    n, steps = sizes.nodes, sizes.steps
    unknowns = 2 * n - 1
    kept = steps if sizes.want & WANT_ADJOINT else 1
    forward = 1 if sizes.want & WANT_SENSITIVITIES else 0
    backward = 1 if sizes.want & WANT_ADJOINT else 0
    lengths = {
        AT_SCALARS: SCALAR_COUNT,
        AT_MASSES: n,
        AT_BENDS: 6 * (n - 2),
        AT_TIMES: TIME_WIDTH * steps,
        AT_ACTIONS: 12 * sizes.blocks,
        AT_POSITIONS: 3 * n * (steps + NEW),
        AT_ORIENTATIONS: 4 * (n - 1) * (steps + NEW),
        AT_TARGETS: 3 * n,
        AT_TARGET_ORIENTATIONS: 4 * (n - 1),
        AT_TARGET_SLOPES: 3 * (n - 1),
        AT_TENSIONS: 3 * (n - 1),
        AT_ACCEPTED: 3 * n,
        AT_ACCEPTED_ORIENTATIONS: 4 * (n - 1),
        AT_HESSIAN: HESSIAN_WIDTH * unknowns * kept,
        AT_GRADIENT: 3 * unknowns,
        AT_STEP: 3 * unknowns,
        AT_INERTIA_COUPLINGS: 9 * NEW * (n - 1),
        AT_EFFECTIVE_BENDS: EFFECTIVE_WIDTH * (n - 2),
        AT_BEND_JACOBIANS: 27 * (n - 2),
        AT_TOUCHES: TOUCH_HEAD + TOUCH_WIDTH * sizes.touches,
        AT_TOUCH_COLUMNS: 3 * unknowns * sizes.touches,
        AT_TOUCH_MATRIX: (sizes.touches + 1) * sizes.touches,
        AT_TOUCH_VECTORS: 9 * unknowns if sizes.touches else 0,
        AT_REPORT: REPORT_WIDTH * steps,
        AT_SENSITIVITIES: forward * (NEW + 1) * 18 * unknowns * sizes.columns,
        AT_SENSITIVITIES_OUT: forward * sizes.horizon * n * 18 * sizes.columns,
        AT_PARAMETER_FORCES: 18 * unknowns * -(-sizes.parameters // 6),
        AT_ADJOINT: backward * 3 * unknowns * (steps + NEW),
        AT_COST: backward * 3 * n * sizes.horizon,
        AT_ACTIONS_OUT: backward * 12 * sizes.blocks,
        AT_PARAMETERS_OUT: backward * sizes.parameters,
    }
    offsets = {}
    at = 0
    for name, length in lengths.items():
        offsets[name] = (at, length)
        at += length
    return offsets, at
