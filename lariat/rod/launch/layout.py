"""Layout of the two arrays that the kernel works on.

A launch takes an integer array and an array of doubles, because its cost grows with the number of
its arguments, and because NumPy views into the doubles save copies of inputs and results.

The integers are a `Header`, the offset of every `Section`, the action block of each step, and a row
for each differentiated parameter. In the doubles, each rod of a batch owns `Header.STRIDE` numbers,
cut into sections; the obstacles, which all rods of the batch share, follow after the last rod.

The unknowns of a rod come in blocks of three: block 2 i is the position of node i, block 2 i + 1
the rotation of edge i, a tangent vector in the edge's own frame. The Hessian couples a block with
the next two, so that a row of blocks is three 3x3 matrices: H(j, j), H(j+1, j) and H(j+2, j).

A clamp adds a grip edge to its end of the chain: an edge without length and energy, whose frame is
that of the grip and both of whose nodes lie at the grip. The bend between it and the first edge of
the rod clamps the rod at the grip, whatever the number of nodes.

A history has `HISTORY_SLOTS` slots for the solves before a roll-out, the last of which is its
start; solve t fills slot t + HISTORY_SLOTS.
"""

from __future__ import annotations

from enum import IntEnum, auto

CLAMP_WEIGHTS = (5.0 / 12.0, 13.0 / 12.0)
"""Edges over which the bends at a clamp and at the node beside it act [-].

A deflection is the sum of the bends times their levers, a trapezoidal rule for curvature times
lever. Weights of 1/2, 1, 1, ... leave its boundary term, which does not vanish at a clamp; these
are the weights of Gregory's end correction.
"""
HISTORY_SLOTS = 4
"""Number of earlier solves that may enter one; slot of a history that the first solve fills."""


class Header(IntEnum):
    """Places of sizes and options in the integer array."""

    BATCH = 0
    NODES = auto()
    """Nodes of the chain, with one more for each clamp than the rod has."""
    STEPS = auto()
    """Implicit solves."""
    HORIZON = auto()
    """Requested steps, each of `SUBSTEPS` solves."""
    SUBSTEPS = auto()
    HISTORY = auto()
    """Number of earlier solves that enter one, at most HISTORY_SLOTS."""
    FIRST_EDGE = auto()
    """First edge of the rod: 1 after the grip edge of a clamp, else 0."""
    END_EDGE = auto()
    """Edge after the last one of the rod."""
    FIRST_FREE = auto()
    """First block of unknowns that no grip drives."""
    END_FREE = auto()
    """Block after the last one that no grip drives."""
    LEFT_END = auto()
    """`EndHold` of the left end; that of the right end follows."""
    RIGHT_END = auto()
    MAX_ITERATIONS = auto()
    CONTACT_SAMPLES = auto()
    """Points of an edge that are tested for contact with obstacles."""
    SELF_CONTACT_SAMPLES = auto()
    """Points of an edge that are tested for contact with other edges."""
    SELF_CONTACT_GAP = auto()
    """Smallest difference of the indices of two edges that may touch each other."""
    ACTION_BLOCKS = auto()
    OBSTACLES = auto()
    PARAMETERS = auto()
    STATE_DIRECTIONS = auto()
    """Directions of the initial state that sensitivities are carried along."""
    ACTION_GROUPS = auto()
    """Groups of sensitivities to actions: one for each block, or none."""
    DERIVATIVES = auto()
    """`Derivatives` that are computed."""
    FRICTION_PAIRS = auto()
    """Pairs of a sample of an edge and an obstacle, each with a slip; zero without friction."""
    LAYERS = auto()
    """Layers of each bend that yield; zero for a rod that springs back."""
    MAX_SELF_CONTACTS = auto()
    """Capacity for contacts of the rod with itself; zero without self-contact."""
    OBSTACLE_ROWS = auto()
    """Offset of the obstacles in the doubles."""
    STRIDE = auto()
    """Doubles of each rod."""


class Section(IntEnum):
    """Sections of a rod; the integer array holds their offsets from the start of the rod."""

    SCALARS = len(Header)
    MASSES = auto()
    BENDS = auto()
    """Stiffness [N m] and rest angles [rad] of each bend, three numbers each."""
    LAYERS = auto()
    """A `LayerRow` for each layer."""
    TIMES = auto()
    """A `TimeRow` for each solve."""
    ACTIONS = auto()
    POSITIONS = auto()
    ORIENTATIONS = auto()
    TARGET_POSITIONS = auto()
    """Positions to which inertia alone would lead, in every solve if the adjoint is computed; after
    the launch, the last velocities."""
    TARGET_ORIENTATIONS = auto()
    TARGET_DERIVATIVES = auto()
    """Derivative of the moments of inertia with respect to the share of velocity that is kept."""
    TENSIONS = auto()
    """Stretch forces of the mixed Newton method; after the launch, the last angular velocities."""
    ACCEPTED_POSITIONS = auto()
    """Iterate from which a line search starts."""
    ACCEPTED_ORIENTATIONS = auto()
    HESSIAN = auto()
    """Hessian, then its factors; those of every solve if the adjoint is computed."""
    TRANSPOSED_HESSIAN = auto()
    """The same of the transposed Hessian, which differs with friction; else the same section."""
    GRADIENT = auto()
    NEWTON_STEP = auto()
    INERTIA_COUPLINGS = auto()
    EFFECTIVE_BENDS = auto()
    BEND_JACOBIANS = auto()
    LANES = auto()
    """Terms of up to `LANE_COUNT` neighbouring edges or bends, term by term."""
    REPORTS = auto()
    """A `ReportRow` for each solve."""
    SENSITIVITIES = auto()
    SENSITIVITIES_OUT = auto()
    PARAMETER_DERIVATIVES = auto()
    """Derivative of the gradient with respect to each parameter."""
    ADJOINT = auto()
    COST_GRADIENT = auto()
    ACTIONS_OUT = auto()
    PARAMETERS_OUT = auto()
    SLIPS = auto()
    """Elastic slip of each pair before the roll-out and after each solve [m]."""
    FROZEN_FRICTION = auto()
    """A `FrozenFriction` of each pair."""
    FRICTION_CONTACTS = auto()
    """Number of touching pairs, `FrictionMode`, and their `FrictionContact`s."""
    SLIP_SENSITIVITIES = auto()
    """Columns of the slips, in groups as those of `SENSITIVITIES`."""
    SLIP_STAMPS = auto()
    """Last solve in which a pair touched; -1 before the first."""
    SLIP_ADJOINT = auto()
    SETS = auto()
    """Curvature and twist that each layer of each bend keeps, before the roll-out and after each
    solve [1/m]."""
    SET_SENSITIVITIES = auto()
    """Columns of the sets, in groups as those of `SENSITIVITIES`."""
    SET_ADJOINT = auto()
    SELF_CONTACTS = auto()
    SELF_CONTACT_COLUMNS = auto()
    SELF_CONTACT_MATRIX = auto()
    SELF_CONTACT_VECTORS = auto()


MODEL_HEADER = slice(Header.FIRST_EDGE, Header.SELF_CONTACT_GAP + 1)
"""Integers of the header that depend on the rod alone."""
STEP_BLOCKS = len(Header) + len(Section)
"""Place in the integer array of the action block of the first step; the parameters follow."""
PARAMETER_WIDTH = 3
"""Integers of a parameter: its `ParameterCode`, the knot of a profile, and the number of knots."""


class Scalar(IntEnum):
    """Places of a rod's constants in their section; those of `RodProperties` have its names."""

    STRETCH_STIFFNESS = 0
    DAMPING = auto()
    EDGE_LENGTH = auto()
    GRAVITY_X = auto()
    GRAVITY_Y = auto()
    GRAVITY_Z = auto()
    CONTACT_STIFFNESS = auto()
    CONTACT_REACH = auto()
    """Distance of the centre line from an obstacle below which contact forces act [m]."""
    CONTACT_MARGIN = auto()
    TOLERANCE = auto()
    BENDING_STIFFNESS = auto()
    TWISTING_STIFFNESS = auto()
    LINEAR_DENSITY = auto()
    BENDING_INERTIA = auto()
    """Moment of inertia of an edge about an axis across it [kg m^2]."""
    TWISTING_INERTIA = auto()
    """Moment of inertia of an edge about its own axis [kg m^2]."""
    INTERNAL_DAMPING = auto()
    DRAG_COEFFICIENT = auto()
    AIR_DENSITY = auto()
    FRICTION_FACTOR = auto()


class ParameterCode(IntEnum):
    """Parameters of the rod with respect to which derivatives can be taken, by their names."""

    BENDING_STIFFNESS = 0
    TWISTING_STIFFNESS = auto()
    STRETCH_STIFFNESS = auto()
    DAMPING = auto()
    INTERNAL_DAMPING = auto()
    DRAG_COEFFICIENT = auto()
    LINEAR_DENSITY = auto()
    LENGTH = auto()
    REST_CURVATURE_1 = auto()
    """Curvature about d1, of the whole rod or of a knot; that about d2 and the twist follow."""
    REST_CURVATURE_2 = auto()
    REST_TWIST = auto()
    STIFFNESS_PROFILE = auto()
    DENSITY_PROFILE = auto()
    YIELD_CURVATURE = auto()
    FRICTION_FACTOR = auto()
    FRICTION = auto()
    """Coefficient of friction of an obstacle, of which the knot is the index."""


class TimeRow(IntEnum):
    """Numbers of a solve, in the section of times.

    A grip moves for `GRIP_DURATION` from its pose `GRIP_SOLVES_BACK` solves before. Velocity
    is the displacement from the base over the duration; base, and the displacement that inertia
    adds to it, are sums of the positions of the last solves.
    """

    DURATION = 0
    KEEPS_VELOCITY = 1
    """One, or zero for a solve without inertia's displacement and internal damping."""
    GRIP_SOLVES_BACK = 2
    GRIP_DURATION = 3
    YIELDS = 4
    """One, or zero for a solve after which the layers of the bends keep what they kept before."""
    BASE_SHARES = 5
    """Shares of the last solves in the base, the latest first."""
    MOMENTUM_SHARES = BASE_SHARES + HISTORY_SLOTS
    """Shares of the last solves in the displacement by inertia, the latest first."""


TIME_WIDTH = TimeRow.MOMENTUM_SHARES + HISTORY_SLOTS
"""Numbers of a `TimeRow`."""


class EffectiveBend(IntEnum):
    """Numbers of a bend in a solve: internal damping acts as added stiffness and another rest."""

    STIFFNESS = 0
    REST = 3
    DAMPED_FROM = 6
    """Rotation vector of the bend at the base, at which internal damping has no moment."""


class LayerRow(IntEnum):
    """Numbers of a layer of the bends."""

    SHARE = 0
    """Share of the stiffness that it bears [-]."""
    LIMIT = 1
    """Curvature at which it yields [1/m]."""
    BY_YIELD = 2
    """Derivative of that in the curvature at which the rod begins to yield [-]."""


class SelfContact(IntEnum):
    """Numbers of a contact between a point of an edge and the nearest point of another edge."""

    EDGE = 0
    OTHER_EDGE = 1
    PLACE = 2
    """Place of the point along its edge, from 0 to 1."""
    OTHER_PLACE = 3
    NORMAL = 4
    """Unit vector from the other point to the point."""
    COMPLIANCE = 7
    """Inverse of the contact's stiffness [m/N]."""
    OTHER_DIRECTION = 8
    """Unit vector along the other edge; zero where the other point is an end of it."""
    OTHER_INVERSE_LENGTH = 11
    """One over the length of the other edge [1/m]; zero where the other point is an end of it."""
    DISTANCE = 12
    FORCE = 13


SELF_CONTACT_HEAD = 2
"""Numbers before the self-contacts: their count, and the count of those beyond the capacity."""


class FrictionContact(IntEnum):
    """Numbers of a touching pair: a sample of an edge, and an obstacle with friction."""

    EDGE = 0
    PLACE = 1
    """Place of the sample along its edge, from 0 to 1."""
    PAIR = 2
    COEFFICIENT = 3
    NORMAL_FORCE = 4
    NORMAL_STIFFNESS = 5
    """Derivative of the normal force with respect to the depth [N/m]."""
    NORMAL = 6
    CURVATURE = 9
    """Derivative of the normal with respect to the sample [1/m]."""
    PULL = 18
    """Tangential force of the rope on the obstacle [N]."""
    BY_SAMPLE = 21
    """Derivative of the pull with respect to the sample [N/m]."""
    BY_ROTATION = 30
    """Derivative of the pull with respect to rotations of the edge in its own frame [N]."""
    BY_SLIP = 39
    """Derivative of the pull with respect to the slip before [N/m]."""
    BY_COEFFICIENT = 48
    CARRIED = 51
    """Adjoint of the pull."""
    SLIP = 54
    """Slip before the return [m]."""
    DIRECTION = 57
    """Direction in which the sample slides; zero where it sticks."""
    FROZEN_ENERGY = 60


class FrozenFriction(IntEnum):
    """Numbers of a pair at the last accepted iterate."""

    DIRECTION = 0
    """Direction in which the sample slid; zero where it stuck."""
    NORMAL = 3
    SLIP = 6
    LIMIT = 9
    """Largest force of friction [N]."""


FROZEN_FRICTION_WIDTH = 10
"""Numbers of a `FrozenFriction`."""
FRICTION_HEAD = 2
"""Numbers before the `FrictionContact`s."""


FRICTION_CONTACT_WIDTH = 61
"""Numbers of a `FrictionContact`."""


class ReportRow(IntEnum):
    """Numbers that a solve reports."""

    ITERATIONS = 0
    CONVERGED = 1
    LAST_STEP = 2
    """Largest movement in the last Newton step [m]."""
    DEFINITE = 3
    """Whether all pivots of the last Hessian are positive."""


class ObstacleRow(IntEnum):
    """Numbers of an obstacle."""

    SHAPE = 0
    """Code of the shape, `lariat.shapes.ShapeCode`."""
    POSITION = 1
    ROTATION = 4
    """Rotation matrix, row by row."""
    SIZES = 13
    BOUNDING_RADIUS = 16
    FRICTION = 17


LANE_COUNT = 32
"""Most neighbours that are evaluated side by side; a multiple of the lanes of a processor."""
LANE_STRIDE = LANE_COUNT + 8
"""Distance of the terms of an edge or bend in their section; neighbours lie next to each other."""
LANE_TERMS = 50
"""Most terms of an edge, a bend or a sample with friction."""
BEND_LANE_ROTATION = 38
"""First term of a bend's rotation vector."""
LAYER_WIDTH = 3
"""Numbers of a `LayerRow`."""
EFFECTIVE_BEND_WIDTH = 9
"""Numbers of an `EffectiveBend`."""
HESSIAN_WIDTH = 27
"""Numbers of a row of blocks of the Hessian."""
GROUP_COLUMNS = 12
"""Columns of forward sensitivities that are carried on together: those of a block's actions at both
ends, three vectors of four lanes."""
COLUMNS_WIDTH = 3 * GROUP_COLUMNS
"""Numbers of a block of unknowns in a group of columns, row by row."""
COLUMNS_STRIDE = (HISTORY_SLOTS + 2) * COLUMNS_WIDTH
"""Numbers of a block in the section of sensitivities: its rows after the last solve and after each
of `HISTORY_SLOTS` earlier ones, and a sum. Their distances are constants, for the sake of lanes."""
MATRIX_WIDTH = 9
"""Numbers of a 3x3 matrix, at a multiple of which sections of matrices start: the array of doubles
is also read as one of 3x3 matrices."""
SELF_CONTACT_WIDTH = 14
"""Numbers of a `SelfContact`."""
REPORT_WIDTH = 4
"""Numbers of a `ReportRow`."""
OBSTACLE_WIDTH = 18
"""Numbers of an `ObstacleRow`."""
